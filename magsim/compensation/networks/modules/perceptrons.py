"""Plain back-propagation networks: multilayer perceptrons on one sample or on a flattened window."""

from collections.abc import Sequence
from typing import Literal

from torch import Tensor, nn

Activation = Literal["relu", "tanh", "gelu"]
_ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "tanh": nn.Tanh, "gelu": nn.GELU}


def _layers(inputs: int, hidden: Sequence[int], activation: Activation) -> nn.Sequential:
    layers: list[nn.Module] = []
    for size in hidden:
        layers += [nn.Linear(inputs, size), _ACTIVATIONS[activation]()]
        inputs = size
    return nn.Sequential(*layers, nn.Linear(inputs, 1))


class SampleMLP(nn.Module):
    """The same perceptron at every time: knows no past and no future (paper 001's BP).

    Parameters
    ----------
    channels : int
    hidden : sequence of int
        Sizes of the hidden layers.
    activation : {"relu", "tanh", "gelu"}
    """

    def __init__(self, channels: int, hidden: Sequence[int] = (64, 64), activation: Activation = "relu") -> None:
        super().__init__()
        self.layers = _layers(channels, hidden, activation)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T)."""
        return self.layers(x.transpose(1, 2)).squeeze(2)

    def start_at_zero(self) -> None:
        """Set the last layer to zero, so that an untrained network returns zeros."""
        _zero(self.layers)


class WindowMLP(nn.Module):
    """A perceptron on a whole window that returns its last sample (paper 000's BPNN, a reconstruction).

    With 19 channels, 320 samples and 112 hidden units it has 681,185 parameters and 681,072 multiply-accumulates;
    the paper prints 0.684 million.

    Parameters
    ----------
    channels, window : int
    hidden : sequence of int
        Sizes of the hidden layers.
    activation : {"relu", "tanh", "gelu"}
    """

    def __init__(
        self, channels: int, window: int = 320, hidden: Sequence[int] = (112,), activation: Activation = "relu"
    ) -> None:
        super().__init__()
        self.layers = _layers(channels * window, hidden, activation)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, 1)."""
        return self.layers(x.flatten(1))

    def start_at_zero(self) -> None:
        """Set the last layer to zero, so that an untrained network returns zeros."""
        _zero(self.layers)


def _zero(layers: nn.Sequential) -> None:
    last = layers[-1]
    assert isinstance(last, nn.Linear)
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
