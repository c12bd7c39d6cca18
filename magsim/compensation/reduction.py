"""Band-passed rows for fits: filtered by their spectrum, cropped at the ends, and thinned to what the band needs.

A fit needs the same linear operator on both sides of its equations and no more, so the filter may be applied to the
spectrum of a padded piece: for a hundred columns that is ten times faster than running it forward and backward.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft, signal

from magsim import signals
from magsim.errors import DataError

_PAD_S = 15.0
"""Padding of a piece at both ends, held: beside the rows that are left out there."""


@dataclass(frozen=True)
class _Piece:
    """Rows that are filtered as one."""

    table: int
    rows: slice
    keep: np.ndarray
    """Thinned rows that are kept."""


class Reduction:
    """Band-pass, crop and thin tables of rows, always by the same linear map.

    Parameters
    ----------
    times_s : sequence of (n,) [s]
        Time tags of each recording.
    reads : sequence of (n,) bool
        Rows that may be kept; where a row may not, the piece is cut.
    rate_hz : float
    band_hz : (float, float) [Hz]
        The amplitude is that of a Butterworth filter of order 4, forward and backward, as scores are computed.
    every : int
        One of so many rows is returned.
    edge_s : float [s]
        Left out at both ends of a piece.

    Raises
    ------
    DataError
        If no row is left.
    """

    def __init__(
        self,
        times_s: Sequence[np.ndarray],
        reads: Sequence[np.ndarray],
        rate_hz: float,
        *,
        band_hz: tuple[float, float] = signals.BAND_HZ,
        every: int = 4,
        edge_s: float = signals.EDGE_S,
    ) -> None:
        self.rate_hz, self.band_hz, self.every = rate_hz, band_hz, every
        self.per_row = rate_hz / every / (2.0 * (band_hz[1] - band_hz[0]))
        self._pieces: list[_Piece] = []
        for number, (time_s, read) in enumerate(zip(times_s, reads, strict=True)):
            for span in _cut(time_s, read):
                count = span.stop - span.start
                at = np.arange(0, count, every) / rate_hz
                keep = (at >= edge_s) & (at <= (count - 1) / rate_hz - edge_s)
                if keep.any():
                    self._pieces.append(_Piece(number, span, keep))
        if not self._pieces:
            spans = (span for time_s, read in zip(times_s, reads, strict=True) for span in _cut(time_s, read))
            longest = max(((span.stop - span.start) / rate_hz for span in spans), default=0.0)
            msg = (
                f"no training rows are left: a piece without a gap needs more than {2.0 * edge_s:g} s, and the longest "
                f"has {longest:g} s"
            )
            raise DataError(msg)

    @property
    def rows(self) -> int:
        """Number of rows that are returned."""
        return sum(int(piece.keep.sum()) for piece in self._pieces)

    def __call__(self, tables: Sequence[np.ndarray]) -> np.ndarray:
        """Reduce one table (c, n) for each recording, a column in each line; returns (rows, c)."""
        return np.concatenate([self._one(piece, tables[piece.table][:, piece.rows]) for piece in self._pieces])

    def of_table(self) -> np.ndarray:
        """Return the number of the recording of each returned row, (rows,)."""
        return np.concatenate([np.full(int(piece.keep.sum()), piece.table) for piece in self._pieces])

    def _one(self, piece: _Piece, values: np.ndarray) -> np.ndarray:
        columns, count = values.shape
        pad = int(_PAD_S * self.rate_hz) // self.every * self.every
        size = self.every * fft.next_fast_len((count + 2 * pad) // self.every + 1, real=True)
        padded = np.empty((columns, size))
        padded[:, :pad] = values[:, :1]
        padded[:, pad : pad + count] = values
        padded[:, pad + count :] = values[:, -1:]
        spectrum = fft.rfft(padded)
        response = _response(size, self.every, self.rate_hz, self.band_hz)
        thin = fft.irfft(spectrum[:, : len(response)] * response, n=size // self.every)
        first = pad // self.every
        return np.ascontiguousarray(thin[:, first : first + len(piece.keep)][:, piece.keep].T)


@lru_cache(maxsize=64)
def _response(size: int, every: int, rate_hz: float, band_hz: tuple[float, float]) -> np.ndarray:
    """Return what the spectrum of a padded piece is multiplied with."""
    sos = signal.butter(4, band_hz, "band", fs=rate_hz, output="sos")
    hz = np.arange(size // every // 2 + 1) * (rate_hz / size)
    response = np.abs(signal.sosfreqz(sos, worN=hz, fs=rate_hz)[1]) ** 2 / every
    response.setflags(write=False)
    return response


def _cut(time_s: np.ndarray, read: np.ndarray) -> list[slice]:
    """Return the pieces without a gap in time and without a row that may not be kept."""
    found = []
    for span in signals.spans(time_s):
        marks = np.flatnonzero(np.diff(np.concatenate([[0], read[span].astype(int), [0]])))
        found += [slice(span.start + int(a), span.start + int(b)) for a, b in marks.reshape(-1, 2)]
    return found
