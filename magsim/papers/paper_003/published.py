"""What paper 003 prints: Tables 1 to 3."""

from collections.abc import Mapping
from typing import NamedTuple


class Network(NamedTuple):
    """A cell of Table 2: layers and activation of the LSTM, then of the perceptron behind it."""

    lstm_layers: int
    lstm_activation: str
    dense_layers: int
    dense_activation: str

    @property
    def name(self) -> str:
        """Both parts in words."""
        return f"{self.lstm_layers} {self.lstm_activation} / {self.dense_layers} {self.dense_activation}"


TABLE_1: Mapping[str, Mapping[str, float]] = {
    "LSTM-BP": {"static": 19.68, "dynamic": 14.33},
    "BP": {"static": 12.69, "dynamic": 2.80},
    "LSTM": {"static": 10.83, "dynamic": 8.81},
}
"""Improvement ratio by model and world."""

TABLE_2: Mapping[Network, float] = {
    Network(1, "tanh", 1, "tanh"): 14.116,
    Network(1, "tanh", 1, "relu"): 12.200,
    Network(1, "sigmoid", 1, "tanh"): 5.496,
    Network(1, "sigmoid", 1, "relu"): 3.943,
    Network(1, "tanh", 2, "tanh"): 24.868,
    Network(1, "tanh", 2, "relu"): 5.226,
    Network(1, "sigmoid", 2, "tanh"): 7.909,
    Network(1, "sigmoid", 2, "relu"): 4.310,
    Network(2, "tanh", 1, "tanh"): 10.832,
    Network(2, "tanh", 1, "relu"): 14.194,
    Network(2, "sigmoid", 1, "tanh"): 7.422,
    Network(2, "sigmoid", 1, "relu"): 9.665,
    Network(2, "tanh", 2, "relu"): 16.667,
    Network(2, "tanh", 2, "tanh"): 25.879,
    Network(2, "sigmoid", 2, "relu"): 5.549,
    Network(2, "sigmoid", 2, "tanh"): 6.166,
}
"""Improvement ratio by network, in the paper's order."""

BEST = Network(2, "tanh", 2, "tanh")
CHOSEN = Network(1, "tanh", 2, "tanh")
"""The best of Table 2, and the one that the paper takes, as it is faster: its LSTM-BP."""

TABLE_3: Mapping[str, Mapping[str, float]] = {
    "LSTM-BP": {"pp before": 11968.55, "pp after": 478.44, "std before": 1056.53, "std after": 34.27, "ir pp": 25.02},
    "GRU-BP": {
        "pp before": 19718.07,
        "pp after": 1484.378,
        "std before": 1729.11,
        "std after": 100.317,
        "ir pp": 13.28,
    },
    "LSTM": {"pp before": 19718.07, "pp after": 2122.51, "std before": 1568.27, "std after": 127.515, "ir pp": 9.29},
    "BP": {"pp before": 15843.31, "pp after": 4632.54, "std before": 1391.39, "std after": 410.11, "ir pp": 3.42},
}
"""Peak to peak and standard deviation of the interference before and after [nT], and their improvement ratio."""
