"""MagTCN of paper 000, with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.modules.magtcn import MagTCN
from magsim.compensation.networks.settings import Count, Kernel, NetworkSettings


@dataclass(frozen=True, kw_only=True)
class MagTCNSettings(NetworkSettings):
    """Parameters of ``magtcn``.

    Attributes
    ----------
    width, expansion, kernel, head, revin, blocks
        See ``magsim.compensation.networks.MagTCN``. Window statistics (``revin``) hurt on a residual.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    # The held-out error rises first and falls below its start only after some hundred steps.
    patience: Count = 40
    width: Count = 8
    expansion: Count = 2
    kernel: Kernel = 51
    head: Literal["flat", "per-time", "last"] = "per-time"
    revin: bool = False
    blocks: Count = 1

    @property
    def context(self) -> int | None:
        """The window where its last sample alone is returned."""
        return self.window if self.head == "last" else None


class MagTCNCompensator(NetworkCompensator):
    """MagTCN of Wang and Zuo (paper 000) on what a Tolles-Lawson stage leaves; parameters: ``MagTCNSettings``."""

    name = "magtcn"
    settings_type = MagTCNSettings
    settings: MagTCNSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        # Seconds on one core.
        "quick": {"width": 4, "steps": 1000, "batch": 8, "every": 50, "learning_rate": 1e-2, "patience": 20},
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
        )
