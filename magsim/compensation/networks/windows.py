"""A network over a whole recording: overlapping windows, or windows that end at the rows they tell of."""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from magsim.signals import spans
from magsim.training import overlap_add, starts_of

BATCH = 16
"""Windows at once. Measured: 256 windows of a wide ResNet leave the processor's cache, and take 2.4 times as long."""

DEVICE_BATCH = 256
"""The same on a device with memory of its own."""


def platform_of(module: nn.Module) -> Callable[[Tensor], Tensor]:
    """Return what gives the platform's part of a network's output: all of it, if the network says nothing else.

    A network that models the Earth's field beside the platform has a method ``platform``; what that returns is
    subtracted, what its ``forward`` returns is fitted.
    """
    return getattr(module, "platform", module)


def apply_network(
    module: nn.Module,
    inputs: np.ndarray,
    time_s: np.ndarray,
    *,
    window: int,
    stride: int,
    context: int | None,
    platform: bool = False,
) -> np.ndarray:
    """Return the output of a network over a recording, piece by piece.

    Parameters
    ----------
    module : nn.Module
        Maps windows (b, c, t) to (b, t), or to (b, t - context + 1) with a context.
    inputs : (n, c)
        Of the precision of the network.
    time_s : (n,) [s]
    window, stride : int
        Rows of a window, and between windows that overlap.
    context : int, optional
        Rows that an output is made from, its own the last of them; see ``NetworkSettings.context``.
    platform : bool
        Return the platform's part alone; see ``platform_of``.

    Returns
    -------
    (n,)
        NaN in the first ``context - 1`` rows of a piece.
    """
    module.eval()
    function = platform_of(module) if platform else module
    device = next((parameter.device for parameter in module.parameters()), None)

    def outputs(windows: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return function(torch.from_numpy(windows).to(device)).cpu().numpy().astype(float)

    out = np.full(len(inputs), np.nan)
    for span in spans(time_s):
        piece = inputs[span]
        if context is None:
            out[span] = overlap_add(outputs, piece, length=window, stride=stride)
        elif len(piece) >= context:
            batch = BATCH if device is None or device.type == "cpu" else DEVICE_BATCH
            out[span.start + context - 1 : span.stop] = _ends(outputs, piece, min(window, len(piece)), context, batch)
    return out


def _ends(
    outputs: Callable[[np.ndarray], np.ndarray], piece: np.ndarray, window: int, context: int, batch: int
) -> np.ndarray:
    """Return the outputs of a piece from row ``context - 1`` on, from windows side by side."""
    told = window - context + 1
    starts = np.array(starts_of(len(piece), window, told))
    out = np.empty(len(piece) - context + 1)
    for i in range(0, len(starts), batch):
        rows = starts[i : i + batch, None] + np.arange(window)
        for start, values in zip(
            starts[i:], outputs(np.ascontiguousarray(piece[rows].transpose(0, 2, 1))), strict=False
        ):
            out[start : start + told] = values
    return out
