"""The neural methods: MagTCN and the plain BP network, each with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field
from torch import nn

from magsim.compensation.networks.bp import SampleMLP, WindowMLP
from magsim.compensation.networks.compensator import ResidualNetwork
from magsim.compensation.networks.magtcn import MagTCN
from magsim.compensation.networks.settings import Count, Inputs, Rate, ResidualSettings


def _odd(value: int) -> int:
    if value % 2 == 0:
        msg = f"{value} is even; a kernel has an odd number of samples"
        raise ValueError(msg)
    return value


Kernel = Annotated[int, Field(ge=1), AfterValidator(_odd)]


@dataclass(frozen=True, kw_only=True)
class MagTCNSettings(ResidualSettings):
    """Parameters of ``magtcn``.

    Attributes
    ----------
    width, expansion, kernel, head, revin, blocks
        See ``magsim.compensation.networks.MagTCN``. Window statistics (``revin``) hurt on a residual.
    features, first_stage, ... , threads
        See ``ResidualSettings``.
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
    def last(self) -> bool:
        """Whether the head returns the last sample of a window only."""
        return self.head == "last"


class MagTCNCompensator(ResidualNetwork):
    """MagTCN of Wang and Zuo (paper 000) on what a Tolles-Lawson stage leaves; parameters: ``MagTCNSettings``."""

    name = "magtcn"
    settings_type = MagTCNSettings
    settings: MagTCNSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        # Seconds on one core: for the demonstration.
        "demo": {"width": 4, "steps": 1000, "batch": 8, "every": 50, "learning_rate": 1e-2, "patience": 20},
        # Minutes on one core.
        "cpu": {"width": 8, "steps": 3000, "batch": 16, "every": 100},
        # The paper's sizes and recipe, 200 epochs of windows at every offset: days on a CPU.
        "paper": {
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
            "hold_out": "legs",
            "patience": 1000,
            "refit": False,
        },
    }

    def make_module(self, channels: int) -> nn.Module:
        """Return a MagTCN of these sizes."""
        settings = self.settings
        return MagTCN(
            channels,
            width=settings.width,
            expansion=settings.expansion,
            kernel=settings.kernel,
            window=settings.window,
            head=settings.head,
            revin=settings.revin,
            blocks=settings.blocks,
        )


@dataclass(frozen=True, kw_only=True)
class BPSettings(ResidualSettings):
    """Parameters of ``bp``.

    Attributes
    ----------
    per : {"sample", "window"}
        One sample in, one out, as paper 001; or a flattened window in and its last sample out, as paper 000.
    hidden : tuple of int
        Sizes of the hidden layers.
    activation : {"relu", "tanh", "gelu"}
    features, first_stage, ... , threads
        See ``ResidualSettings``.
    """

    per: Literal["sample", "window"] = "sample"
    hidden: Annotated[tuple[Count, ...], Field(min_length=1)] = (32, 32)
    activation: Literal["relu", "tanh", "gelu"] = "tanh"
    features: Inputs = ("tl16",)
    steps: Count = 4000
    learning_rate: Rate = 1e-2
    patience: Count = 40

    @property
    def last(self) -> bool:
        """Whether a window gives its last sample only."""
        return self.per == "window"


class BPCompensator(ResidualNetwork):
    """Plain back-propagation network on what a Tolles-Lawson stage leaves; parameters: ``BPSettings``."""

    name = "bp"
    settings_type = BPSettings
    settings: BPSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "demo": {"steps": 2000, "batch": 8, "every": 50},
        "cpu": {"steps": 4000, "batch": 16, "every": 100},
        # Paper 000: 6080 inputs, 112 units (a reconstruction); 200 epochs of windows at every offset.
        "paper": {
            "per": "window",
            "hidden": (112,),
            "activation": "relu",
            "features": ("tl16", "attitude"),
            "first_stage": "none",
            "band_weight": 0.0,
            "steps": 3500,
            "batch": 256,
            "learning_rate": 1e-3,
            "decay": False,
            "every": 100,
            "hold_out": "legs",
            "patience": 1000,
            "refit": False,
        },
        # Paper 001: 18 columns, one sample at a time. Sizes are not printed.
        "paper001": {
            "per": "sample",
            "hidden": (64, 64),
            "activation": "relu",
            "features": ("tl18",),
            "first_stage": "none",
            "band_weight": 0.0,
            "steps": 4000,
            "batch": 8,
            "learning_rate": 1e-3,
            "decay": False,
            "every": 100,
            "hold_out": "legs",
            "patience": 1000,
            "refit": False,
        },
    }

    @property
    def is_windowed(self) -> bool:
        """False for single samples: they know no other."""
        return self.settings.last

    def make_module(self, channels: int) -> nn.Module:
        """Return a perceptron of these sizes."""
        settings = self.settings
        if settings.last:
            return WindowMLP(channels, settings.window, settings.hidden, settings.activation)
        return SampleMLP(channels, settings.hidden, settings.activation)
