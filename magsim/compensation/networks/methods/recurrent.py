"""LSTM-BP, GRU-BP and LSTM of paper 003, with their presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED
from magsim.compensation.networks.modules.recurrent import RecurrentNet
from magsim.compensation.networks.settings import Count, Inputs, NetworkSettings, Rate

PAPER003: Mapping[str, object] = {
    **PRINTED,
    # with three angles and the time the 20 that are printed; constant coefficients and the reading are no inputs
    "inputs": ("tl16", "angles", "time"),
    "hidden": 64,
    # the window is not printed; 5 s, with the output at its last sample
    "window": 50,
    "taps": 50,
    # 100 iterations, taken as epochs of 12 000 windows at every offset
    "steps": 18_750,
    "batch": 64,
}
"""What is printed of all three, and the choices where nothing is."""

QUICK: Mapping[str, object] = {"steps": 60, "batch": 8, "every": 10, "learning_rate": 2e-2}
"""Seconds on one core."""


@dataclass(frozen=True, kw_only=True)
class GRUBPSettings(NetworkSettings):
    """Parameters of ``gru_bp``, and what ``lstm_bp`` and ``lstm`` have too.

    Attributes
    ----------
    hidden, layers : int
        Units and layers of the recurrent part.
    dense : tuple of int
        Sizes of the layers behind it.
    dense_activation : {"tanh", "relu"}
    taps : int
        Samples that an output is made from, its own the last of them; while the network learns, the rows of a window
        from the ``taps``-th on have an output each.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    hidden: Count = 8
    layers: Count = 1
    dense: tuple[Count, ...] = (16,)
    dense_activation: Literal["tanh", "relu"] = "tanh"
    taps: Count = 10
    inputs: Inputs = ("tl16",)
    window: Count = 180
    steps: Count = 200
    learning_rate: Rate = 1e-2
    every: Count = 25

    @property
    def context(self) -> int:
        """Rows that an output is made from."""
        return self.taps


@dataclass(frozen=True, kw_only=True)
class LSTMBPSettings(GRUBPSettings):
    """Parameters of ``lstm_bp``.

    Attributes
    ----------
    activation : {"tanh", "sigmoid"}
        Of candidate and output of the LSTM; see ``ActivatedLSTM``.
    hidden, layers, dense, dense_activation, taps
        See ``GRUBPSettings``.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    activation: Literal["tanh", "sigmoid"] = "tanh"
    steps: Count = 400


@dataclass(frozen=True, kw_only=True)
class LSTMSettings(LSTMBPSettings):
    """Parameters of ``lstm``: those of ``lstm_bp``, without dense layers unless asked for."""

    dense: tuple[Count, ...] = ()


class GRUBPCompensator(NetworkCompensator):
    """GRU with a perceptron behind it (paper 003's GRU-BP); parameters: ``GRUBPSettings``."""

    name = "gru_bp"
    settings_type = GRUBPSettings
    settings: GRUBPSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": QUICK,
        "paper": {**PAPER003, "dense": (64, 32)},
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a network of these sizes."""
        settings = self.settings
        return RecurrentNet(
            len(names),
            unit="gru",
            hidden=settings.hidden,
            layers=settings.layers,
            dense=settings.dense,
            dense_activation=settings.dense_activation,
            context=settings.taps,
        )


class LSTMBPCompensator(NetworkCompensator):
    """LSTM with a perceptron behind it (paper 003's LSTM-BP); parameters: ``LSTMBPSettings``."""

    name = "lstm_bp"
    settings_type = LSTMBPSettings
    settings: LSTMBPSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": QUICK,
        "paper": {**PAPER003, "dense": (64, 32)},
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a network of these sizes."""
        settings = self.settings
        return RecurrentNet(
            len(names),
            unit="lstm",
            hidden=settings.hidden,
            layers=settings.layers,
            activation=settings.activation,
            dense=settings.dense,
            dense_activation=settings.dense_activation,
            context=settings.taps,
        )


class LSTMCompensator(LSTMBPCompensator):
    """LSTM and one linear output (paper 003's LSTM); parameters: ``LSTMSettings``."""

    name = "lstm"
    settings_type = LSTMSettings
    settings: LSTMSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {"default": {}, "quick": QUICK, "paper": PAPER003}
