"""Sub-networks of paper 004: one small perceptron for each part of the measured field, with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED
from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.compensation.networks.modules.committee import Committee
from magsim.compensation.networks.parts import Part, places, refuse
from magsim.compensation.networks.settings import Count, Inputs, NetworkSettings, Optimizer, Weight
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.training import reproducible

NETS: Mapping[str, tuple[Part, bool]] = {
    "Z1": ("time", False),
    "Z2": ("position", False),
    "Z3": ("permanent", True),
    "Z4": ("induced", True),
    "Z5": ("eddy", True),
    "Z6": ("travel", False),
}
"""For each sub-network the columns that it reads, and whether it models the aircraft."""


@dataclass(frozen=True, kw_only=True)
class SubnetworksSettings(NetworkSettings):
    """Parameters of ``subnetworks``.

    Attributes
    ----------
    taps : int
        Samples that an output is made from, its own the last of them.
    inputs : tuple of str
        There are as many sub-networks as these have parts: Z3 to Z5 of the Tolles-Lawson columns, and those of the
        Earth's field, which are fitted and never subtracted: Z1 of ``time``, Z2 of ``position``, Z6 of ``travel``.
    first_stage, ... , threads
        See ``NetworkSettings``.
    """

    inputs: Inputs = ("tl16",)
    taps: Count = 3
    optimizer: Optimizer = "lm"
    band_weight: Weight = 10.0
    steps: Count = 30
    every: Count = 1
    patience: Count = 8

    @property
    def context(self) -> int:
        """Rows that an output is made from."""
        return self.taps


class SubnetworksCompensator(NetworkCompensator):
    """Sub-networks for the parts of the field (paper 004); parameters: ``SubnetworksSettings``."""

    name = "subnetworks"
    settings_type = SubnetworksSettings
    settings: SubnetworksSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"steps": 6, "every": 2, "folds": 2, "band_weight": 0.0},
        # How long is not printed.
        "paper": {
            **PRINTED,
            "inputs": ("tl16", "time", "position", "travel"),
            "target": "measured",
            "optimizer": "lm",
            "steps": 100,
            "every": 5,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return the sub-networks that the input columns ask for; half as many units as inputs, rounded down.

        Raises
        ------
        RequestError
            If a column belongs to no sub-network, or none is of the aircraft.
        """
        refuse(names, "other", reader="subnetworks", allowed="Tolles-Lawson columns, time, position, travel")
        taps, branches = self.settings.taps, {}
        for net, (part, platform) in NETS.items():
            columns = places(names, part)
            if columns:
                branches[net] = Branch(columns, max(taps * len(columns) // 2, 1), platform)
        if not any(branch.platform for branch in branches.values()):
            msg = "inputs: subnetworks subtracts what Tolles-Lawson columns explain; allowed: inputs with tl16 or tl18"
            raise RequestError(msg)
        return AddedBranches(branches, taps)

    def parts(self, recording: Recording) -> dict[str, np.ndarray]:
        """Return what each sub-network makes of a recording, (n,) [nT] by name, NaN in the warm-up.

        Z3 to Z5 add up to the estimate, less its constant and what a first stage explains; the others are the Earth's
        field, less a constant.

        Raises
        ------
        RequestError
            If the method is not fitted, or a column is missing.
        """
        self.check_fitted()
        self._require(recording)
        fitted = self._fitted
        inputs = fitted.inputs(recording.blind(self.requires))
        module = fitted.module
        members = module.members if isinstance(module, Committee) else [module]
        nets = [one for one in members if isinstance(one, AddedBranches)]
        found = {}
        with reproducible(self.settings.threads):
            for name in nets[0].columns:
                outputs = [fitted.output(net.alone(name), inputs, recording.time_s) for net in nets]
                found[name] = fitted.gain_nt * np.mean(outputs, axis=0)
        return found
