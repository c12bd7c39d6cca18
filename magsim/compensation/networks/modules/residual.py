"""Res-Bp: a perceptron with skips (Yu et al., Appl. Sci. 2022, 12, 10759), on single samples."""

from typing import Literal

from torch import Tensor, nn

ResBpActivation = Literal["relu", "tanh"]
_ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "tanh": nn.Tanh}


class SkipLayer(nn.Module):
    """z to f(z + F(z)), F two linear layers with f between them (paper 001's residual layer)."""

    def __init__(self, width: int, activation: ResBpActivation) -> None:
        super().__init__()
        kind = _ACTIVATIONS[activation]
        self.path = nn.Sequential(nn.Linear(width, width), kind(), nn.Linear(width, width))
        self.activation = kind()

    def forward(self, z: Tensor) -> Tensor:
        """Map (..., width) to the same shape."""
        return self.activation(z + self.path(z))


class ResBp(nn.Module):
    """Projection, residual layers, linear output: the same at every time.

    With 18 channels, width 64 and 3 layers it has 26,241 parameters and 25,792 multiply-accumulates. The paper prints
    neither depth nor width.

    Parameters
    ----------
    channels, width, layers : int
    activation : {"relu", "tanh"}
        The paper's is ReLU.
    """

    def __init__(
        self, channels: int, *, width: int = 64, layers: int = 3, activation: ResBpActivation = "relu"
    ) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(channels, width),
            _ACTIVATIONS[activation](),
            *(SkipLayer(width, activation) for _ in range(layers)),
        )
        self.head = nn.Linear(width, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T)."""
        return self.head(self.layers(x.transpose(1, 2))).squeeze(2)

    def start_at_zero(self) -> None:
        """Set the head to zero, so that an untrained network returns zeros."""
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)
