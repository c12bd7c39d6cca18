"""Plain back-propagation networks: BP of papers 001 and 003, and BPNN of paper 000, each with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field
from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.compensation.networks.settings import Count, Folds, Inputs, NetworkSettings, Optimizer, Weight

Hidden = Annotated[tuple[Count, ...], Field(min_length=1)]
Activation = Literal["relu", "tanh", "gelu"]

PRINTED: Mapping[str, object] = {
    "optimizer": "adam",
    "weight_decay": 0.0,
    "first_stage": "none",
    "band_weight": 0.0,
    "learning_rate": 1e-3,
    "decay": False,
    "every": 100,
    "hold_out": "split",
    "shrink": False,
    "patience": 1000,
    "refit": False,
}
"""What the papers have in common: the interference itself is learned, with Adam at a constant rate."""


@dataclass(frozen=True, kw_only=True)
class BPSettings(NetworkSettings):
    """Parameters of ``bp``.

    Attributes
    ----------
    hidden : tuple of int
        Sizes of the hidden layers.
    activation : {"relu", "tanh", "gelu"}
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    hidden: Hidden = (16,)
    activation: Activation = "tanh"
    inputs: Inputs = ("tl16",)
    optimizer: Optimizer = "lm"
    band_weight: Weight = 10.0
    weight_decay: Weight = 1e-4
    steps: Count = 30
    every: Count = 1
    patience: Count = 8
    folds: Folds = 5
    refit: bool = False

    @property
    def context(self) -> int:
        """A row alone."""
        return 1


class BPCompensator(NetworkCompensator):
    """Plain perceptron on single samples (papers 001 and 003); parameters: ``BPSettings``."""

    name = "bp"
    settings_type = BPSettings
    settings: BPSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"hidden": (8,), "steps": 10, "every": 2, "folds": 2},
        # Paper 001: 18 columns, ReLU. Sizes and recipe are not printed: 200 epochs of 9 minutes, 256 rows a step.
        "paper": {
            **PRINTED,
            "inputs": ("tl18",),
            "hidden": (64, 64),
            "activation": "relu",
            "window": 1,
            "steps": 4200,
            "batch": 256,
        },
        # Paper 003: sizes and tanh. 100 iterations, taken as epochs of 20 minutes, 64 rows a step; its 20 inputs.
        "paper003": {
            **PRINTED,
            "inputs": ("tl16", "angles", "time"),
            "hidden": (128, 64),
            "activation": "tanh",
            "window": 1,
            "steps": 18_750,
            "batch": 64,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a perceptron of these sizes."""
        return SampleMLP(len(names), self.settings.hidden, self.settings.activation)


@dataclass(frozen=True, kw_only=True)
class BPNNSettings(NetworkSettings):
    """Parameters of ``bpnn``.

    Attributes
    ----------
    hidden, activation
        See ``BPSettings``.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    hidden: Hidden = (16,)
    activation: Activation = "tanh"
    window: Count = 40
    steps: Count = 1000
    batch: Count = 64
    every: Count = 50
    folds: Folds = 2

    @property
    def context(self) -> int:
        """The window, whose last sample alone is returned."""
        return self.window


class BPNNCompensator(NetworkCompensator):
    """Perceptron on a flattened window (paper 000's BPNN, a reconstruction); parameters: ``BPNNSettings``."""

    name = "bpnn"
    settings_type = BPNNSettings
    settings: BPNNSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"steps": 300},
        # 6080 inputs, 112 units; 200 epochs of windows at every offset.
        "paper": {
            **PRINTED,
            "inputs": ("tl16", "angles"),
            "hidden": (112,),
            "activation": "relu",
            "window": 320,
            "steps": 3500,
            "batch": 256,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a perceptron of these sizes."""
        return WindowMLP(len(names), self.settings.window, self.settings.hidden, self.settings.activation)
