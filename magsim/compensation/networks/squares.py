"""What Levenberg-Marquardt is given: all rows that are learned, and the loss as a linear operator on their errors.

The loss is that of ``losses.ResidualLoss``, over all rows instead of random windows.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from magsim.compensation.networks.losses import BAND_EDGE_S, band_matrix
from magsim.errors import DataError, RequestError
from magsim.training import starts_of

GROUP_S = 32.0
"""Length of what is filtered at once, where the network does not fix it by its window [s]."""

RATE_HZ = 2.5
"""Rate at which errors count. Of what passes 0.6 Hz a thousandth is left at the Nyquist frequency, and the normal
equations take most of the time, so that a row in four at 10 Hz takes a third of it and finds the same."""


class LearnedPiece(NamedTuple):
    """Rows without a gap: inputs (n, c), targets (n,), and which of them are learned (n,)."""

    inputs: np.ndarray
    targets: np.ndarray
    learned: np.ndarray


class Squares(NamedTuple):
    """Inputs (n, c, t), targets (n, o), weights (n, o) and operator of ``magsim.training.train_levenberg``."""

    inputs: Tensor
    targets: Tensor
    weights: Tensor
    operator: Tensor | None


def squares_of(
    pieces: Sequence[LearnedPiece], rate_hz: float, *, context: int | None, window: int, band_weight: float
) -> Squares:
    """Return the squares that are to be made small.

    Parameters
    ----------
    pieces : sequence of LearnedPiece
        Those too short for one group of errors are left out.
    rate_hz : float [Hz]
    context : int, optional
        Rows that an output is made from, its own the last of them. Without one, the network maps windows to windows.
    window : int
        Rows of a window of a network without context.
    band_weight : float
        Weight of the mean square of the errors in band, beside that of all; 0 leaves the band-pass out.

    Raises
    ------
    DataError
        If no piece is long enough.
    RequestError
        If a window is too short for the band-pass.
    """
    taps = window if context is None else context
    group, stride, operator = 1, 1, None
    if context is None:
        group, stride = window, window
    if band_weight > 0.0:
        group = window if context is None else round(GROUP_S * rate_hz)
        stride = group - 2 * round(BAND_EDGE_S * rate_hz)
        try:
            operator = torch.from_numpy(_operator(group, rate_hz, band_weight))
        except ValueError as error:
            raise RequestError(str(error)) from None
    parts = [
        part for piece in pieces if (part := _cut(piece, taps, group, stride, in_windows=context is None)) is not None
    ]
    if not parts:
        need = group if context is None else group + taps - 1
        longest = max((len(piece.targets) for piece in pieces), default=0)
        msg = f"the loss takes {need} rows at once, but the longest piece without a gap has {longest}"
        raise DataError(msg)
    inputs, targets, learned = (torch.from_numpy(np.concatenate(each)) for each in zip(*parts, strict=True))
    return Squares(inputs, targets, learned.double(), operator)


def _operator(group: int, rate_hz: float, band_weight: float) -> np.ndarray:
    """Return errors as they are, without what the band-pass spoils at the ends, and errors in band, (k, group)."""
    band = band_matrix(group, rate_hz)
    edge, every = (group - len(band)) // 2, max(int(rate_hz / RATE_HZ), 1)
    whole = np.eye(group)[edge : group - edge]
    return np.sqrt(every) * np.concatenate([whole[::every], np.sqrt(band_weight) * band[::every]])


def _cut(
    piece: LearnedPiece, taps: int, group: int, stride: int, *, in_windows: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return inputs (m, c, taps), targets (m, o) and learned rows (m, o) of a piece; None if it is too short.

    Groups of which nothing is learned are left out.
    """
    told = len(piece.targets) if in_windows else len(piece.targets) - taps + 1
    if told < group:
        return None
    starts = np.array(starts_of(told, group, stride))
    learned = piece.learned if in_windows else piece.learned[taps - 1 :]
    starts = starts[[bool(learned[start : start + group].any()) for start in starts]]
    inputs = np.lib.stride_tricks.sliding_window_view(piece.inputs, taps, axis=0)
    # what is not learned may be missing
    targets = np.where(learned, piece.targets[len(piece.targets) - told :], 0.0)
    rows = starts[:, None] + np.arange(group)
    if in_windows:
        return inputs[starts], targets[rows], learned[rows]
    rows = rows.reshape(-1)
    return inputs[rows], targets[rows, None], learned[rows, None]
