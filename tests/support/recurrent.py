"""A small recurrent network for tests of training."""

from torch import Tensor, nn


class LastOfRecurrent(nn.Module):
    """LSTM, GRU or RNN and a linear layer on its last state: (b, c, t) to (b, 1)."""

    def __init__(self, kind: str, channels: int, hidden: int) -> None:
        super().__init__()
        self.cells = getattr(nn, kind)(channels, hidden, batch_first=True)
        self.out = nn.Linear(hidden, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (b, c, t) to (b, 1)."""
        return self.out(self.cells(x.transpose(1, 2))[0][:, -1])
