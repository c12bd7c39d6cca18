"""Rows on disk, for training on more than fits into memory: written once, then read window by window."""

import hashlib
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from magsim.errors import RequestError


class Spool:
    """An array (n, c) of float32 that grows row by row, in a file without a name.

    The system removes the file when it is closed, and with the process, however that ends. Values are read, not mapped:
    mapped pages would count as memory of the process. It is a context manager, which closes.

    Parameters
    ----------
    columns : int
    folder : Path, optional
        On the disk that the file is to be on; the system's folder for temporary files if not given.
    """

    def __init__(self, columns: int, folder: Path | None = None) -> None:
        self.columns = columns
        self.folder = Path(tempfile.gettempdir() if folder is None else folder)
        self._rows = 0
        self._digest = hashlib.sha256()
        try:
            self._file = tempfile.TemporaryFile(dir=self.folder, buffering=0)  # noqa: SIM115 - closed by __exit__
        except OSError as error:
            raise self._refused(error) from None

    def __enter__(self) -> "Spool":
        return self

    def __exit__(self, *_error: object) -> None:
        self._file.close()

    def __len__(self) -> int:
        return self._rows

    def append(self, values: np.ndarray) -> None:
        """Write rows, (m, c), at the end.

        Raises
        ------
        RequestError
            If the disk is full, or the file cannot be written for another reason: it is gone then.
        """
        rows = np.ascontiguousarray(values, dtype="<f4")
        if rows.shape != (len(rows), self.columns):
            msg = f"rows of shape {rows.shape} for {self.columns} columns"
            raise ValueError(msg)
        left = rows.data.cast("B")
        self._digest.update(left)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            self._file.close()
            raise self._refused(error) from None
        self._rows += len(rows)

    def read(self, first: int, out: np.ndarray) -> np.ndarray:
        """Fill an array (m, c) of float32 with the rows from one on, and return it."""
        if os.preadv(self._file.fileno(), [out.data], 4 * self.columns * first) != out.nbytes:
            msg = f"rows {first} to {first + len(out) - 1} of {self._rows}"
            raise IndexError(msg)
        return out

    @property
    def digest(self) -> str:
        """SHA-256 of all rows."""
        return self._digest.hexdigest()

    def _refused(self, error: OSError) -> RequestError:
        written = 4e-6 * self.columns * self._rows
        return RequestError(
            f"the rows to learn from cannot be kept in {self.folder}: {error.strerror or error}, after {written:.0f} "
            "MB; allowed: a folder on a disk with more room"
        )


class SpooledWindows:
    """Windows of a spool; a ``WindowSource``.

    Parameters
    ----------
    spool : Spool
    pieces : sequence of (int, int)
        First row and number of rows of each piece without a gap; those shorter than a window are left out.
    rows : int
        Rows of a window.
    shift, scale : (c,)
        Windows hold (value - shift) / scale.

    Raises
    ------
    ValueError
        If no piece is as long as a window.
    """

    def __init__(
        self, spool: Spool, pieces: Sequence[tuple[int, int]], *, rows: int, shift: np.ndarray, scale: np.ndarray
    ) -> None:
        first, length = np.array(pieces, dtype=np.int64).reshape(-1, 2).T
        kept = length >= rows
        if not kept.any():
            msg = f"a window has {rows} rows, but the longest piece without a gap has {length.max(initial=0)}"
            raise ValueError(msg)
        self.rows = rows
        self.total_rows = int(length[kept].sum())
        self._spool, self._first = spool, first[kept]
        self._ends = np.cumsum(length[kept] - rows + 1)
        self._shift, self._scale = np.asarray(shift, dtype=np.float32), np.asarray(scale, dtype=np.float32)

    def __len__(self) -> int:
        return int(self._ends[-1])

    def take(self, indices: np.ndarray) -> np.ndarray:
        """Return windows, (m, rows, c) float32."""
        pieces = np.searchsorted(self._ends, indices, side="right")
        before = np.where(pieces > 0, self._ends[pieces - 1], 0)
        out = np.empty((len(indices), self.rows, self._spool.columns), dtype=np.float32)
        for window, start in zip(out, (self._first[pieces] + indices - before).tolist(), strict=True):
            self._spool.read(start, window)
        out -= self._shift
        out /= self._scale
        return out
