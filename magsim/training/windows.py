"""Windows of time series: sources of windows, random batches for training, overlapping windows for use."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from magsim.training import distributed


class WindowSource(Protocol):
    """Windows of a fixed number of rows, numbered from 0.

    In memory (``ArrayWindows``), or read from files (``magsim.recording.windows.Windows``).
    """

    @property
    def rows(self) -> int:
        """Rows of a window."""

    @property
    def total_rows(self) -> int:
        """Rows of all pieces that have windows."""

    def __len__(self) -> int:
        """Return the number of windows: one for every row that a window can begin with."""

    def take(self, indices: np.ndarray) -> np.ndarray:
        """Return windows, (m, rows, c)."""


class ArrayWindows:
    """Windows of arrays in memory.

    Parameters
    ----------
    pieces : sequence of (n_i, c)
        Without gaps; pieces shorter than a window are left out.
    rows : int
        Rows of a window.

    Raises
    ------
    ValueError
        If no piece is as long as a window.
    """

    def __init__(self, pieces: Sequence[np.ndarray], *, rows: int) -> None:
        long = [piece for piece in pieces if len(piece) >= rows]
        if not long:
            longest = max((len(piece) for piece in pieces), default=0)
            msg = f"a window has {rows} rows, but the longest piece without a gap has {longest}"
            raise ValueError(msg)
        self.rows = rows
        self.total_rows = sum(len(piece) for piece in long)
        self._values = np.concatenate(long)
        firsts = np.cumsum([0, *(len(piece) for piece in long[:-1])])
        self._starts = np.concatenate(
            [np.arange(first, first + len(piece) - rows + 1) for first, piece in zip(firsts, long, strict=True)]
        )

    def __len__(self) -> int:
        return len(self._starts)

    def take(self, indices: np.ndarray) -> np.ndarray:
        """Return windows, (m, rows, c)."""
        return self._values[self._starts[indices][:, None] + np.arange(self.rows)]


class RandomBatches:
    """Batches of windows at random offsets; every window is as likely as any other.

    Of several processes each gets its share of the same batch.

    Parameters
    ----------
    sources : sequence of WindowSource
        Inputs, targets, ...: the same windows of different columns.
    batch : int
        Windows of a batch.

    Raises
    ------
    ValueError
        If the sources have different windows.
    RequestError
        If the batch cannot be shared among the processes.
    """

    def __init__(self, sources: Sequence[WindowSource], *, batch: int) -> None:
        if len({(len(source), source.rows) for source in sources}) != 1:
            sizes = ", ".join(f"{len(source)} of {source.rows} rows" for source in sources)
            msg = f"the sources of batches need the same windows, and have {sizes}"
            raise ValueError(msg)
        self.rows = sources[0].total_rows
        self._sources = tuple(sources)
        self._batch, self._share = batch, distributed.share(batch)

    def __call__(self, generator: torch.Generator) -> tuple[Tensor, ...]:
        """Return this process's share of a batch of each source, (batch, c, rows) float32."""
        picks = torch.randint(len(self._sources[0]), (self._batch,), generator=generator).numpy()[self._share]
        windows = (np.ascontiguousarray(source.take(picks).transpose(0, 2, 1)) for source in self._sources)
        return tuple(torch.from_numpy(values.astype(np.float32, copy=False)) for values in windows)


def starts_of(rows: int, length: int, stride: int) -> list[int]:
    """Return the first rows of windows that cover a piece: every ``stride``, and one that ends at the last row."""
    if rows <= length:
        return [0]
    return sorted({*range(0, rows - length, stride), rows - length})


def overlap_add(
    function: Callable[[np.ndarray], np.ndarray], inputs: np.ndarray, *, length: int, stride: int, batch: int = 16
) -> np.ndarray:
    """Apply a function of windows to a whole piece and blend what overlaps with Hann weights.

    Parameters
    ----------
    function : callable
        Maps (b, c, length) to (b, length).
    inputs : (n, c)
        A piece shorter than a window is extended by its last row.
    length, stride : int
        Rows of a window and between windows.
    batch : int
        Windows at once.

    Returns
    -------
    (n,)
    """
    rows = len(inputs)
    padded = inputs if rows >= length else np.concatenate([inputs, np.repeat(inputs[-1:], length - rows, axis=0)])
    # A small floor, so that the first and the last row of the piece, which one window alone reaches, have weight.
    weight = np.hanning(length + 2)[1:-1] + 1e-3
    total, weights = np.zeros(len(padded)), np.zeros(len(padded))
    starts = starts_of(len(padded), length, stride)
    for i in range(0, len(starts), batch):
        chunk = starts[i : i + batch]
        windows = np.stack([padded[start : start + length].T for start in chunk])
        for start, values in zip(chunk, function(windows), strict=True):
            total[start : start + length] += weight * values
            weights[start : start + length] += weight
    return (total / weights)[:rows]
