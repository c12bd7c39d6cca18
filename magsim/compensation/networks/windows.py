"""A network over a whole recording: overlapping windows, or windows that end at each row."""

import numpy as np
import torch
from torch import nn

from magsim.signals import spans
from magsim.training import overlap_add

BATCH = 256
"""Windows at once where each gives its last sample."""


def apply_network(
    module: nn.Module, inputs: np.ndarray, time_s: np.ndarray, *, window: int, stride: int, last: bool
) -> np.ndarray:
    """Return the output of a network over a recording, piece by piece.

    Parameters
    ----------
    module : nn.Module
        Maps windows (b, c, window) to (b, window), or to (b, 1) with ``last``.
    inputs : (n, c)
        Of the precision of the network.
    time_s : (n,) [s]
    window, stride : int
        Rows of a window, and between windows that overlap.
    last : bool
        The network returns the last sample of a window only.

    Returns
    -------
    (n,)
        NaN in the first window of a piece with ``last``.
    """
    module.eval()

    def outputs(windows: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return module(torch.from_numpy(windows)).numpy().astype(float)

    out = np.full(len(inputs), np.nan)
    for span in spans(time_s):
        piece = inputs[span]
        if not last:
            out[span] = overlap_add(outputs, piece, length=window, stride=stride)
        elif len(piece) >= window:
            windows = np.lib.stride_tricks.sliding_window_view(piece, window, axis=0)
            parts = [outputs(windows[i : i + BATCH].copy())[:, 0] for i in range(0, len(windows), BATCH)]
            out[span.start + window - 1 : span.stop] = np.concatenate(parts)
    return out
