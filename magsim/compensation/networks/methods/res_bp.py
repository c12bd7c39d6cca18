"""Res-Bp of paper 001, with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED
from magsim.compensation.networks.modules.residual import ResBp, ResBpActivation
from magsim.compensation.networks.settings import Count, Folds, Inputs, NetworkSettings, Optimizer, Weight


@dataclass(frozen=True, kw_only=True)
class ResBpSettings(NetworkSettings):
    """Parameters of ``res_bp``.

    Attributes
    ----------
    width, layers : int
        Units of each layer, and residual layers.
    activation : {"relu", "tanh"}
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    width: Count = 8
    layers: Count = 1
    activation: ResBpActivation = "tanh"
    inputs: Inputs = ("tl16",)
    optimizer: Optimizer = "lm"
    band_weight: Weight = 10.0
    steps: Count = 30
    every: Count = 1
    patience: Count = 8
    folds: Folds = 5
    refit: bool = False

    @property
    def context(self) -> int:
        """A row alone."""
        return 1


class ResBpCompensator(NetworkCompensator):
    """Perceptron with skips on single samples (paper 001's Res-Bp); parameters: ``ResBpSettings``."""

    name = "res_bp"
    settings_type = ResBpSettings
    settings: ResBpSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"steps": 10, "every": 2, "folds": 2},
        # 18 columns and ReLU are printed; 200 epochs of 9 minutes, 256 rows a step.
        "paper": {
            **PRINTED,
            "inputs": ("tl18",),
            "width": 64,
            "layers": 3,
            "activation": "relu",
            "window": 1,
            "steps": 4200,
            "batch": 256,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a Res-Bp of these sizes."""
        settings = self.settings
        return ResBp(len(names), width=settings.width, layers=settings.layers, activation=settings.activation)
