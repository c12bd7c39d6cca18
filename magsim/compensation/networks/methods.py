"""The neural methods: MagTCN and the plain BP network, each with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field
from torch import nn

from magsim.compensation.networks.bp import SampleMLP, WindowMLP
from magsim.compensation.networks.magtcn import MagTCN
from magsim.compensation.networks.residual import Count, Features, Rate, ResidualNetwork


def _odd(value: int) -> int:
    if value % 2 == 0:
        msg = f"{value} is even; a kernel has an odd number of samples"
        raise ValueError(msg)
    return value


Kernel = Annotated[int, Field(ge=1), AfterValidator(_odd)]


@dataclass(kw_only=True, eq=False, repr=False)
class MagTCNCompensator(ResidualNetwork):
    """MagTCN of Wang and Zuo (paper 000) on what a Tolles-Lawson stage leaves.

    Parameters
    ----------
    width, expansion, kernel, head, revin, blocks
        See ``magsim.compensation.networks.MagTCN``. Window statistics (``revin``) hurt on a residual.
    features, first_stage, ... , threads
        See ``ResidualNetwork``.
    """

    name = "magtcn"
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

    # The held-out error rises first and falls below its start only after some hundred steps.
    patience: Count = 40
    width: Count = 8
    expansion: Count = 2
    kernel: Kernel = 51
    head: Literal["flat", "per-time", "last"] = "per-time"
    revin: bool = False
    blocks: Count = 1

    @property
    def last(self) -> bool:  # type: ignore[override]
        """Whether the head puts out the last sample of a window only."""
        return self.head == "last"

    def make_module(self, channels: int) -> nn.Module:
        """A MagTCN of these sizes."""
        return MagTCN(
            channels,
            width=self.width,
            expansion=self.expansion,
            kernel=self.kernel,
            window=self.window,
            head=self.head,
            revin=self.revin,
            blocks=self.blocks,
        )


@dataclass(kw_only=True, eq=False, repr=False)
class BPCompensator(ResidualNetwork):
    """Plain back-propagation network on what a Tolles-Lawson stage leaves.

    Parameters
    ----------
    per : {"sample", "window"}
        One sample in, one out, as paper 001; or a flattened window in and its last sample out, as paper 000.
    hidden : tuple of int
        Sizes of the hidden layers.
    activation : {"relu", "tanh", "gelu"}
    features, first_stage, ... , threads
        See ``ResidualNetwork``.
    """

    name = "bp"
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

    per: Literal["sample", "window"] = "sample"
    hidden: Annotated[tuple[Count, ...], Field(min_length=1)] = (32, 32)
    activation: Literal["relu", "tanh", "gelu"] = "tanh"
    features: Features = ("tl16",)
    steps: Count = 4000
    learning_rate: Rate = 1e-2
    patience: Count = 40

    @property
    def last(self) -> bool:  # type: ignore[override]
        """Whether a window gives its last sample only."""
        return self.per == "window"

    @property
    def causal(self) -> bool:  # type: ignore[override]
        """True: a sample knows no other, and a window ends at its output."""
        return True

    def make_module(self, channels: int) -> nn.Module:
        """A perceptron of these sizes."""
        if self.last:
            return WindowMLP(channels, self.window, self.hidden, self.activation)
        return SampleMLP(channels, self.hidden, self.activation)
