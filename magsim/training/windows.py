"""Windows of a time series: random ones for training, overlapping ones for use."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor


class RandomWindows:
    """Batches of windows at random offsets in pieces without gaps; every offset is as likely as any other.

    Parameters
    ----------
    inputs : sequence of (n_i, c)
    targets : sequence of (n_i, k)
        One pair for each piece; pieces shorter than a window are left out.
    length : int
        Rows of a window.
    batch : int
        Windows of a batch.

    Raises
    ------
    ValueError
        If no piece is as long as a window.
    """

    def __init__(self, inputs: Sequence[np.ndarray], targets: Sequence[np.ndarray], *, length: int, batch: int) -> None:
        pairs = [(x, y) for x, y in zip(inputs, targets, strict=True) if len(y) >= length]
        if not pairs:
            longest = max((len(y) for y in targets), default=0)
            msg = f"a window has {length} rows, but the longest piece without a gap has {longest}"
            raise ValueError(msg)
        self.rows = sum(len(y) for _, y in pairs)
        self._inputs = torch.tensor(np.concatenate([x for x, _ in pairs]), dtype=torch.float32)
        self._targets = torch.tensor(np.concatenate([y for _, y in pairs]), dtype=torch.float32)
        firsts, base = [], 0
        for _, y in pairs:
            firsts.append(torch.arange(base, base + len(y) - length + 1))
            base += len(y)
        self._starts = torch.cat(firsts)
        self._within = torch.arange(length)
        self._batch = batch

    def __call__(self, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """A batch: inputs (batch, c, length) and targets (batch, k, length)."""
        picks = torch.randint(len(self._starts), (self._batch,), generator=generator)
        rows = self._starts[picks, None] + self._within
        return tuple(part[rows].transpose(1, 2).contiguous() for part in (self._inputs, self._targets))


def starts_of(rows: int, length: int, stride: int) -> list[int]:
    """First rows of windows that cover a piece: every ``stride``, and one that ends at the last row."""
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
