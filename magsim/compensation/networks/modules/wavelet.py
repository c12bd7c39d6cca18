"""Bidirectional LSTM on wavelet features, after Sensors 2025, 25(18), 5774: a reconstruction."""

import torch
from torch import Tensor, nn


def wavelet_parts(x: Tensor, levels: int) -> list[Tensor]:
    """Split signals into parts of different time scale, by the undecimated ("à trous") Haar wavelet.

    Level j smooths over two samples that lie 2^j apart, and its detail is what the smoothing takes away; so the
    details and the last smooth part add up to the signal. Before a window begins its first sample is repeated.

    Parameters
    ----------
    x : (B, M, T)
    levels : int

    Returns
    -------
    list of (B, M, T)
        The details of each level, then the last smooth part.
    """
    parts, smooth = [], x
    for level in range(levels):
        shift = min(2**level, x.shape[2])
        earlier = torch.cat([smooth[:, :, :1].expand(-1, -1, shift), smooth[:, :, :-shift]], dim=2)
        coarser = 0.5 * (smooth + earlier)
        parts.append(smooth - coarser)
        smooth = coarser
    return [*parts, smooth]


class WaveletBiLSTM(nn.Module):
    """Wavelet details beside the signals themselves, an LSTM in both directions of time, one linear output a row.

    Parameters
    ----------
    channels : int
    hidden, layers : int
        Units in each direction, and layers.
    levels : int
        Wavelet levels: details of 2, 4, ..., 2^levels samples.
    """

    def __init__(self, channels: int, *, hidden: int = 32, layers: int = 1, levels: int = 5) -> None:
        super().__init__()
        self.levels = levels
        self.recurrent = nn.LSTM(channels * (levels + 1), hidden, layers, batch_first=True, bidirectional=True)
        self.output = nn.Linear(2 * hidden, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T)."""
        *details, _ = wavelet_parts(x, self.levels)
        # of a slow signal the details double from level to level: so all have about the size of the last
        equal = [detail * 2 ** (self.levels - 1 - level) for level, detail in enumerate(details)]
        outputs, _ = self.recurrent(torch.cat([x, *equal], dim=1).transpose(1, 2))
        return self.output(outputs).squeeze(2)

    def start_at_zero(self) -> None:
        """Set the last layer to zero, so that an untrained network returns zeros."""
        nn.init.zeros_(self.output.weight)
        nn.init.zeros_(self.output.bias)
