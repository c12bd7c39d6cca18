"""WilliamsNN: three perceptrons whose outputs are added up (paper 000, after Williams 1993), with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED
from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.compensation.networks.parts import places, refuse
from magsim.compensation.networks.settings import Count, Inputs, NetworkSettings, Optimizer, Weight
from magsim.errors import RequestError


@dataclass(frozen=True, kw_only=True)
class WilliamsSettings(NetworkSettings):
    """Parameters of ``williams``.

    Attributes
    ----------
    mode : {"tl", "field"}
        ``tl``: branches of the permanent columns with attitude and all else, of the induced and of the eddy-current
        columns. ``field``: f of the position, g of the time, h of all else; h alone is subtracted.
    hidden : int
        Units of each branch.
    taps : int
        Samples that an output is made from, its own the last of them.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    mode: Literal["tl", "field"] = "tl"
    hidden: Count = 8
    taps: Count = 1
    inputs: Inputs = ("tl16",)
    optimizer: Optimizer = "lm"
    band_weight: Weight = 10.0
    steps: Count = 30
    every: Count = 1
    patience: Count = 8

    @property
    def context(self) -> int:
        """Rows that an output is made from."""
        return self.taps


class WilliamsCompensator(NetworkCompensator):
    """Three perceptrons side by side (paper 000's WilliamsNN, a reconstruction); parameters: ``WilliamsSettings``."""

    name = "williams"
    settings_type = WilliamsSettings
    settings: WilliamsSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"steps": 10, "every": 2, "folds": 2},
        # 39 units a branch meet the printed 0.238 million; 200 epochs of windows at every offset.
        "paper": {**PRINTED, "inputs": ("tl16", "angles"), "hidden": 39, "taps": 320, "steps": 3500, "batch": 256},
        # Williams 1993: no Tolles-Lawson columns; local field, diurnal variation and interference of the reading.
        "paper1993": {
            **PRINTED,
            "mode": "field",
            "target": "measured",
            "inputs": ("attitude", "rates", "accelerations", "currents", "position", "height", "time"),
            "taps": 1,
            "steps": 4000,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return the branches that the input columns ask for.

        Raises
        ------
        RequestError
            If a branch that the mode is about has no column, or a column no branch.
        """
        settings = self.settings
        branches = _field(names, settings.hidden) if settings.mode == "field" else _terms(names, settings.hidden)
        return AddedBranches({name: branch for name, branch in branches.items() if branch.columns}, settings.taps)


def _terms(names: tuple[str, ...], hidden: int) -> dict[str, Branch]:
    """Return the branches of mode ``tl``."""
    allowed = "Tolles-Lawson columns and what else is of the aircraft (mode field reads position and time)"
    refuse(names, "position", "travel", "time", reader="mode tl", allowed=allowed)
    induced, eddy = places(names, "induced"), places(names, "eddy")
    if not (induced or eddy):
        msg = (
            "inputs: mode tl has a branch each for induced and eddy-current columns; allowed: inputs with tl16 or tl18"
        )
        raise RequestError(msg)
    rest = places(names, "permanent", "other")
    columns = {"permanent": rest, "induced": induced, "eddy": eddy}
    return {name: Branch(found, hidden) for name, found in columns.items()}


def _field(names: tuple[str, ...], hidden: int) -> dict[str, Branch]:
    """Return the branches of mode ``field``."""
    refuse(names, "travel", reader="mode field", allowed="position, time and what is of the aircraft")
    position, time = places(names, "position"), places(names, "time")
    if not (position or time):
        msg = "inputs: mode field has a branch each for position and time; allowed: inputs with position or time"
        raise RequestError(msg)
    own = places(names, "permanent", "induced", "eddy", "other")
    if not own:
        msg = "inputs: mode field subtracts what the aircraft's inputs explain; position and time are none of these"
        raise RequestError(msg)
    return {
        "local": Branch(position, hidden, platform=False),
        "diurnal": Branch(time, hidden, platform=False),
        "interference": Branch(own, hidden),
    }
