"""The anti-alias filter of the recording system and its decimation."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import signal

PASS_EDGE, STOP_EDGE = 0.25, 0.5
"""Edges of the anti-alias filter over the output rate."""

STOP_DB = 86.0
"""Design attenuation of the anti-alias filter [dB]; the pass band ripples by the same amount."""


def run_in_s(rate_out_hz: float) -> float:
    """Time before the first and after the last output row that a ``Decimator`` reads, at most [s].

    True for every input rate of at least 3 times the output rate.
    """
    return 13.0 / rate_out_hz


@dataclass(frozen=True)
class Decimator:
    """Anti-alias filter and decimation of a recording system: centered, linear phase, no delay.

    A Kaiser-window FIR low-pass: gain exactly 1 at zero, within 1e-4 of 1 up to a quarter of the output rate
    (2.5 Hz at 10 Hz out), at least 80 dB down from half of the output rate on, so that nothing folds back.
    Only the wanted output rows are computed.

    Attributes
    ----------
    rate_in_hz : float
    rate_out_hz : float
        Divides ``rate_in_hz``.

    Raises
    ------
    ValueError
        If the output rate does not divide the input rate.
    """

    rate_in_hz: float
    rate_out_hz: float

    def __post_init__(self) -> None:
        ratio = self.rate_in_hz / self.rate_out_hz
        if not (round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-6):
            msg = f"{self.rate_out_hz:g} Hz out does not divide {self.rate_in_hz:g} Hz in"
            raise ValueError(msg)

    @property
    def factor(self) -> int:
        """Input samples for each output row."""
        return round(self.rate_in_hz / self.rate_out_hz)

    @cached_property
    def taps(self) -> np.ndarray:
        """Impulse response, (2 half + 1,), symmetric, sum 1."""
        width = (STOP_EDGE - PASS_EDGE) * self.rate_out_hz / (self.rate_in_hz / 2.0)
        count, beta = signal.kaiserord(STOP_DB, width)
        taps = signal.firwin(
            count | 1,
            (STOP_EDGE + PASS_EDGE) / 2.0 * self.rate_out_hz,
            window=("kaiser", beta),
            fs=self.rate_in_hz,
        )
        taps = (taps + taps[::-1]) / 2.0
        taps /= taps.sum()
        taps.flags.writeable = False
        return taps

    @property
    def half(self) -> int:
        """Input samples that are read on each side of an output row: the run-in the caller provides."""
        return len(self.taps) // 2

    @property
    def description(self) -> str:
        """The response in words, for provenance."""
        return (
            f"linear-phase FIR low-pass, Kaiser window, {len(self.taps)} taps at {self.rate_in_hz:g} Hz, centered; "
            f"gain within 1e-4 of 1 up to {PASS_EDGE * self.rate_out_hz:g} Hz, 80 dB down from "
            f"{STOP_EDGE * self.rate_out_hz:g} Hz; then 1 of {self.factor} samples"
        )

    def everywhere(self, values: np.ndarray) -> np.ndarray:
        """Return the filtered signal at every input sample that has its run-in, (n - 2 half,) from a column (n,).

        Its sample ``i`` belongs to the instant of input sample ``i + half``.
        """
        windows = np.lib.stride_tricks.sliding_window_view(np.ascontiguousarray(values), len(self.taps))
        return np.einsum("nk,k->n", windows, self.taps)

    def rows_of(self, size: int, first: int) -> int:
        """How many output rows an input of ``size`` samples can give, the first centered on sample ``first``."""
        return max(0, (size - 1 - self.half - first) // self.factor + 1)

    def __call__(self, values: np.ndarray, first: int | None = None, rows: int | None = None) -> np.ndarray:
        """Filter and decimate.

        Parameters
        ----------
        values : (n, ...)
            At the input rate.
        first : int
            Sample that the first output row is centered on; at least ``half``, which is also the default.
        rows : int
            How many output rows; by default as many as the input allows.

        Returns
        -------
        (rows, ...)
            Row ``i`` belongs to the instant of input sample ``first + i factor``.

        Raises
        ------
        ValueError
            If the input does not reach ``half`` samples beyond the first and the last row.
        """
        values = np.asarray(values, dtype=float)
        first = self.half if first is None else first
        rows = self.rows_of(len(values), first) if rows is None else rows
        last = first + (rows - 1) * self.factor
        if rows < 1 or first < self.half or last + self.half >= len(values):
            msg = (
                f"{rows} rows from sample {first} on need {self.half} samples of run-in and run-out; "
                f"the input has {len(values)} samples"
            )
            raise ValueError(msg)
        table = values.reshape(len(values), -1)
        out = np.empty((rows, table.shape[1]))
        for column in range(table.shape[1]):
            out[:, column] = self._column(table[:, column], first - self.half, rows)
        return out.reshape(rows, *values.shape[1:])

    def _column(self, values: np.ndarray, start: int, rows: int) -> np.ndarray:
        """One column from a sample on: blocks of taps times blocks of samples, summed along the diagonals.

        Of all ways to the same sums of products it is the fastest; each product sums over one block of as many samples
        as an output row has.
        """
        if values.strides[0] == 0:  # a constant, repeated without memory
            return np.repeat(self._column(values[: len(self.taps)].copy(), 0, 1), rows)
        factor = self.factor
        blocks = (len(self.taps) - 1) // factor
        samples = np.ascontiguousarray(values[start : start + (rows - 1) * factor + len(self.taps)])
        whole, last = self.taps[: blocks * factor].reshape(blocks, factor), self.taps[blocks * factor :]
        products = whole @ samples[: (rows + blocks - 1) * factor].reshape(-1, factor).T
        out = np.lib.stride_tricks.sliding_window_view(samples[blocks * factor :], len(last))[::factor] @ last
        for j in range(blocks):
            out += products[j, j : j + rows]
        return out
