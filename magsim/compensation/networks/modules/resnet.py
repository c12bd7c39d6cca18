"""Residual convolutional network (paper 000's ResNet, a reconstruction)."""

from typing import Literal

from torch import Tensor, nn

ResNetHead = Literal["per-time", "last"]


class ResidualBlock(nn.Module):
    """Two convolutions, each with batch normalization; the input is added before the last ReLU (He et al. 2016).

    Parameters
    ----------
    width, kernel, padding : int
    normalize : bool
        Whether there is batch normalization.
    """

    def __init__(self, width: int, kernel: int, padding: int, *, normalize: bool) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for _ in range(2):
            layers.append(nn.Conv1d(width, width, kernel, padding=padding))
            layers += [nn.BatchNorm1d(width)] if normalize else []
            layers.append(nn.ReLU())
        self.path = nn.Sequential(*layers[:-1])

    def forward(self, h: Tensor) -> Tensor:
        """Map (B, width, T) to the same shape, shorter by what is not padded, its end in place."""
        out = self.path(h)
        return nn.functional.relu(out + h[:, :, h.shape[2] - out.shape[2] :])


class ResNet(nn.Module):
    """Convolution, residual blocks, and a linear head.

    With 19 channels, 320 samples, width 60, 9 blocks and the head ``last`` it has 352,201 parameters and 105.52 million
    multiply-accumulates; the paper prints 105.541.

    Parameters
    ----------
    channels : int
    width : int
        Features between the layers.
    kernel : int
        Samples of each convolution, odd.
    blocks : int
    window : int
        Samples of a window, for the head ``last``.
    head : {"per-time", "last"}
        ``per-time``: one weight for each feature, the same at every time; ``last``: all features of the window to one
        output at its last sample.
    causal : bool
        Make each output of the head ``per-time`` from samples at its time and before: there is no padding, and the
        first samples of a window have no output.
    normalize : bool
        Batch normalization inside the blocks.

    Raises
    ------
    ValueError
        If the kernel is even.
    """

    def __init__(
        self,
        channels: int,
        *,
        width: int = 16,
        kernel: int = 5,
        blocks: int = 4,
        window: int = 320,
        head: ResNetHead = "per-time",
        causal: bool = False,
        normalize: bool = True,
    ) -> None:
        super().__init__()
        if kernel % 2 == 0:
            msg = f"kernel {kernel} must be odd, so that the output keeps its place in time"
            raise ValueError(msg)
        padding = 0 if causal else kernel // 2
        self.entry = nn.Conv1d(channels, width, kernel, padding=padding)
        self.blocks = nn.Sequential(
            *(ResidualBlock(width, kernel, padding, normalize=normalize) for _ in range(blocks))
        )
        self.per_time = head == "per-time"
        self.head = nn.Linear(width if self.per_time else width * window, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T), to (B, T - reach + 1) if causal, or to (B, 1) with the head ``last``."""
        h = self.blocks(nn.functional.relu(self.entry(x)))
        return self.head(h.transpose(1, 2)).squeeze(2) if self.per_time else self.head(h.flatten(1))

    def start_at_zero(self) -> None:
        """Set the head to zero, so that an untrained network returns zeros."""
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)


def reach(kernel: int, blocks: int) -> int:
    """Return the samples that a causal output is made from, its own the last of them."""
    return 1 + (kernel - 1) * (1 + 2 * blocks)
