"""Recurrent networks with a perceptron behind them: LSTM-BP, GRU-BP and LSTM of paper 003 (Xie and Chen, 2026)."""

from collections.abc import Callable, Sequence
from typing import Literal

import torch
from torch import Tensor, nn

Unit = Literal["lstm", "gru"]
CellActivation = Literal["tanh", "sigmoid"]
DenseActivation = Literal["tanh", "relu"]

_DENSE: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU}
_CELL: dict[str, Callable[[Tensor], Tensor]] = {"tanh": torch.tanh, "sigmoid": torch.sigmoid}


class ActivatedLSTM(nn.LSTM):
    """LSTM whose candidate and whose output may use another function than tanh; the gates stay sigmoid.

    This is what ``activation`` of an LSTM layer means in Keras, whose defaults the paper names; ``nn.LSTM`` has tanh
    alone. Weights, their names and their start values are those of ``nn.LSTM``.

    Parameters
    ----------
    inputs, hidden, layers : int
    activation : {"tanh", "sigmoid"}
    """

    def __init__(self, inputs: int, hidden: int, layers: int = 1, activation: CellActivation = "sigmoid") -> None:
        super().__init__(inputs, hidden, layers, batch_first=True)
        self.activation = _CELL[activation]

    def forward(self, x: Tensor) -> tuple[Tensor, tuple[Tensor, Tensor]]:  # type: ignore[override]
        """Map sequences (B, T, inputs) from a state of zeros to (B, T, hidden) and the last state, as ``nn.LSTM``."""
        states = []
        for layer in range(self.num_layers):
            x, h, c = self._layer(x, *(getattr(self, f"{name}_l{layer}") for name in _WEIGHTS))
            states.append((h, c))
        return x, (torch.stack([h for h, _ in states]), torch.stack([c for _, c in states]))

    def _layer(
        self, x: Tensor, weight_ih: Tensor, weight_hh: Tensor, bias_ih: Tensor, bias_hh: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return the outputs (B, T, hidden) of one layer and its last output and memory (B, hidden)."""
        h = c = x.new_zeros(len(x), self.hidden_size)
        outputs = []
        for given in (x @ weight_ih.T + (bias_ih + bias_hh)).unbind(1):
            i, f, candidate, o = (given + h @ weight_hh.T).chunk(4, dim=1)
            c = torch.sigmoid(f) * c + torch.sigmoid(i) * self.activation(candidate)
            h = torch.sigmoid(o) * self.activation(c)
            outputs.append(h)
        return torch.stack(outputs, dim=1), h, c


_WEIGHTS = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")


def _recurrent(unit: Unit, inputs: int, hidden: int, layers: int, activation: CellActivation) -> nn.RNNBase:
    if unit == "gru":
        return nn.GRU(inputs, hidden, layers, batch_first=True)
    if activation == "tanh":
        return nn.LSTM(inputs, hidden, layers, batch_first=True)
    return ActivatedLSTM(inputs, hidden, layers, activation)


class RecurrentNet(nn.Module):
    """Recurrent layers, then dense layers on their output at each time, then one linear output.

    An output is made from ``context`` rows, the last of them its own, from a state of zeros on. While it is trained,
    the network runs through a longer window once and gives an output at every row from the ``context``-th on, which
    has seen at least as many rows: many more outputs for the same work. In use each has seen ``context`` rows exactly,
    so that it does not depend on where a window began.

    Parameters
    ----------
    channels : int
    unit : {"lstm", "gru"}
    hidden, layers : int
        Of the recurrent part.
    activation : {"tanh", "sigmoid"}
        Of an LSTM; see ``ActivatedLSTM``.
    dense : sequence of int
        Sizes of the dense layers, none for a plain LSTM.
    dense_activation : {"tanh", "relu"}
    context : int
    """

    def __init__(
        self,
        channels: int,
        *,
        unit: Unit = "lstm",
        hidden: int = 64,
        layers: int = 1,
        activation: CellActivation = "tanh",
        dense: Sequence[int] = (64, 32),
        dense_activation: DenseActivation = "tanh",
        context: int = 50,
    ) -> None:
        super().__init__()
        self.context = context
        self.recurrent = _recurrent(unit, channels, hidden, layers, activation)
        parts: list[nn.Module] = []
        size = hidden
        for width in dense:
            parts += [nn.Linear(size, width), _DENSE[dense_activation]()]
            size = width
        self.dense = nn.Sequential(*parts)
        self.output = nn.Linear(size, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T - context + 1)."""
        if self.training:
            return self._through(x)
        windows = x.unfold(2, self.context, 1)
        count, rows = len(x), windows.shape[2]
        return self._through(windows.transpose(1, 2).reshape(count * rows, x.shape[1], -1)).reshape(count, rows)

    def _through(self, x: Tensor) -> Tensor:
        outputs, _ = self.recurrent(x.transpose(1, 2))
        return self.output(self.dense(outputs[:, self.context - 1 :])).squeeze(2)

    def start_at_zero(self) -> None:
        """Set the last layer to zero, so that an untrained network returns zeros."""
        nn.init.zeros_(self.output.weight)
        nn.init.zeros_(self.output.bias)
