"""Reconstructions of newer networks from what is public of them, with their presets.

PG-TLNet (Drones 2026, 10(4), 252), the 34-term GA-BP (Sensors 2025, 25(16), 5059) and the time-frequency BiLSTM
(Sensors 2025, 25(18), 5774): their abstracts name the structure, but no sizes; ``docs/networks.md`` has what is whose.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED, BPCompensator, BPSettings, Hidden
from magsim.compensation.networks.modules.guided import GuidedNet
from magsim.compensation.networks.modules.wavelet import WaveletBiLSTM
from magsim.compensation.networks.parts import places
from magsim.compensation.networks.settings import Count, Inputs, NetworkSettings, Rate
from magsim.errors import RequestError

QUICK: Mapping[str, object] = {"steps": 500, "batch": 8, "window": 200, "learning_rate": 2e-2}
"""Seconds on one core, for networks of a row alone."""


@dataclass(frozen=True, kw_only=True)
class PGTLNetSettings(NetworkSettings):
    """Parameters of ``pg_tlnet``.

    Attributes
    ----------
    hidden : tuple of int
        Sizes of the hidden layers of the nonlinear branch.
    nonlinear : {"residual", "coefficients"}
        What that branch gives: interference, or a correction to each Tolles-Lawson coefficient.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    hidden: Hidden = (32, 32)
    nonlinear: Literal["residual", "coefficients"] = "residual"
    steps: Count = 600
    learning_rate: Rate = 1e-2

    @property
    def context(self) -> int:
        """A row alone."""
        return 1


class PGTLNetCompensator(NetworkCompensator):
    """Linear Tolles-Lawson branches and a nonlinear one (a reconstruction); parameters: ``PGTLNetSettings``."""

    name = "pg_tlnet"
    settings_type = PGTLNetSettings
    settings: PGTLNetSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"hidden": (16,), **QUICK},
        # the linear branches learn the coefficients; no size is public
        "paper": {**PRINTED, "inputs": ("tl18", "attitude"), "hidden": (64, 64), "steps": 4000, "batch": 8},
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return the branches that the input columns ask for.

        Raises
        ------
        RequestError
            If no input is a Tolles-Lawson column.
        """
        parts = [places(names, part) for part in ("permanent", "induced", "eddy")]
        branches = [branch for branch in parts if branch]
        if not branches:
            msg = "inputs: pg_tlnet has linear branches of Tolles-Lawson columns; allowed: inputs with tl16 or tl18"
            raise RequestError(msg)
        return GuidedNet(len(names), branches, hidden=self.settings.hidden, nonlinear=self.settings.nonlinear)


@dataclass(frozen=True, kw_only=True)
class GABPSettings(BPSettings):
    """Parameters of ``ga_bp``: those of ``bp``, with 34 columns and one hidden layer unless asked otherwise."""

    inputs: Inputs = ("tl18", "attitude", "coupled")


class GABPCompensator(BPCompensator):
    """Perceptron with one hidden layer on 34 columns (a reconstruction); parameters: ``GABPSettings``.

    The genetic algorithm that gives the paper's network its start weights is left out: weights start at random.
    """

    name = "ga_bp"
    settings_type = GABPSettings
    settings: GABPSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"hidden": (8,), "steps": 10, "every": 2, "folds": 2},
        # "shallow": one hidden layer, whose size is not public
        "paper": {**PRINTED, "hidden": (16,), "steps": 4000, "batch": 8},
    }


@dataclass(frozen=True, kw_only=True)
class WaveletBiLSTMSettings(NetworkSettings):
    """Parameters of ``wavelet_bilstm``.

    Attributes
    ----------
    hidden, layers : int
        Units in each direction of time, and layers.
    levels : int
        Wavelet levels; see ``WaveletBiLSTM``.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    hidden: Count = 8
    layers: Count = 1
    levels: Count = 2
    inputs: Inputs = ("tl16",)
    window: Count = 160
    batch: Count = 32
    steps: Count = 400
    learning_rate: Rate = 1.87e-2
    every: Count = 50


class WaveletBiLSTMCompensator(NetworkCompensator):
    """Bidirectional LSTM on signals and wavelet details (a reconstruction); parameters: ``WaveletBiLSTMSettings``."""

    name = "wavelet_bilstm"
    settings_type = WaveletBiLSTMSettings
    settings: WaveletBiLSTMSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"steps": 60, "batch": 8, "every": 10, "learning_rate": 2e-2},
        # no size is public
        "paper": {
            **PRINTED,
            "hidden": 64,
            "levels": 6,
            "inputs": ("tl16", "attitude"),
            "window": 320,
            "steps": 3500,
            "batch": 16,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a network of these sizes."""
        settings = self.settings
        return WaveletBiLSTM(len(names), hidden=settings.hidden, layers=settings.layers, levels=settings.levels)
