"""MagTCN of paper 000, with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.modules.magtcn import MagTCN, reach
from magsim.compensation.networks.settings import Count, Folds, Kernel, NetworkSettings, Rate
from magsim.errors import RequestError


@dataclass(frozen=True, kw_only=True)
class MagTCNSettings(NetworkSettings):
    """Parameters of ``magtcn``.

    Attributes
    ----------
    width, expansion, kernel, head, revin, blocks
        See ``magsim.compensation.networks.modules.magtcn.MagTCN``. Window statistics (``revin``) hurt on a residual.
    causal : bool
        Make an output of the head ``per-time`` from rows at its time and before.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    # The held-out error rises first and falls below its start only after some hundred steps.
    steps: Count = 600
    batch: Count = 8
    learning_rate: Rate = 1e-2
    every: Count = 50
    patience: Count = 12
    folds: Folds = 2
    width: Count = 4
    expansion: Count = 2
    kernel: Kernel = 51
    head: Literal["flat", "per-time", "last"] = "per-time"
    revin: bool = False
    blocks: Count = 1
    causal: bool = False

    @property
    def context(self) -> int | None:
        """Rows that an output is made from; None where it sees both sides."""
        if self.head == "last":
            return self.window
        return reach(self.kernel, self.blocks) if self.causal else None

    def check(self) -> None:
        """Refuse settings that do not go together; see ``NetworkSettings``."""
        super().check()
        if not self.causal or (self.head == "per-time" and not self.revin):
            return
        reasons = {
            "last": "has no effect with head 'last', whose output is that of the window's last row in any case",
            "flat": "does not go with head 'flat', which sees the whole window; allowed: head 'per-time'",
            "per-time": "does not go with revin, whose statistics are those of the whole window; allowed: revin false",
        }
        msg = f"causal: {reasons[self.head]}"
        raise RequestError(msg)


class MagTCNCompensator(NetworkCompensator):
    """MagTCN of Wang and Zuo (paper 000) on what a Tolles-Lawson stage leaves; parameters: ``MagTCNSettings``."""

    name = "magtcn"
    settings_type = MagTCNSettings
    settings: MagTCNSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        # Seconds on one core.
        "quick": {"steps": 150, "every": 25},
        # The paper's sizes and recipe, 200 epochs of windows at every offset: days on a CPU.
        "paper": {
            "inputs": ("tl16", "angles"),
            "width": 48,
            "head": "flat",
            "revin": True,
            "first_stage": "none",
            "band_weight": 0.0,
            "tutor": 0.05,
            "surgery": True,
            "steps": 3500,
            "batch": 256,
            "learning_rate": 1e-3,
            "decay": False,
            "every": 100,
            "hold_out": "split",
            "shrink": False,
            "patience": 1000,
            "refit": False,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a MagTCN of these sizes."""
        settings = self.settings
        return MagTCN(
            len(names),
            width=settings.width,
            expansion=settings.expansion,
            kernel=settings.kernel,
            window=settings.window,
            head=settings.head,
            revin=settings.revin,
            blocks=settings.blocks,
            causal=settings.causal,
        )
