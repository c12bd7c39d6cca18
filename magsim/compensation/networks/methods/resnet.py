"""ResNet of paper 000, with its presets."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from torch import nn

from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.perceptrons import PRINTED
from magsim.compensation.networks.modules.resnet import ResNet, reach
from magsim.compensation.networks.settings import Count, Kernel, NetworkSettings
from magsim.errors import RequestError


@dataclass(frozen=True, kw_only=True)
class ResNetSettings(NetworkSettings):
    """Parameters of ``resnet``.

    Attributes
    ----------
    width, kernel, blocks, head, normalize
        See ``magsim.compensation.networks.modules.resnet.ResNet``.
    causal : bool
        Make an output of the head ``per-time`` from rows at its time and before.
    inputs, first_stage, ... , threads
        See ``NetworkSettings``.
    """

    width: Count = 8
    kernel: Kernel = 5
    blocks: Count = 2
    head: Literal["per-time", "last"] = "per-time"
    causal: bool = False
    normalize: bool = True
    steps: Count = 600

    def check(self) -> None:
        """Refuse settings that do not go together; see ``NetworkSettings``."""
        super().check()
        if self.causal and self.head == "last":
            msg = "causal: has no effect with head 'last', whose output is that of the window's last row in any case"
            raise RequestError(msg)

    @property
    def context(self) -> int | None:
        """Rows that an output is made from; None where it sees both sides."""
        if self.head == "last":
            return self.window
        return reach(self.kernel, self.blocks) if self.causal else None


class ResNetCompensator(NetworkCompensator):
    """Residual convolutional network (paper 000's ResNet, a reconstruction); parameters: ``ResNetSettings``."""

    name = "resnet"
    settings_type = ResNetSettings
    settings: ResNetSettings
    presets: ClassVar[Mapping[str, Mapping[str, object]]] = {
        "default": {},
        "quick": {"width": 4, "blocks": 1, "steps": 200, "batch": 8, "every": 50, "learning_rate": 1e-2, "folds": 2},
        # The sizes meet the printed 105.541 million; 200 epochs of windows at every offset: a day on a CPU.
        "paper": {
            **PRINTED,
            "inputs": ("tl16", "angles"),
            "width": 60,
            "blocks": 9,
            "head": "last",
            "steps": 3500,
            "batch": 256,
        },
    }

    def make_module(self, names: tuple[str, ...]) -> nn.Module:
        """Return a ResNet of these sizes."""
        settings = self.settings
        return ResNet(
            len(names),
            width=settings.width,
            kernel=settings.kernel,
            blocks=settings.blocks,
            window=settings.window,
            head=settings.head,
            causal=settings.causal,
            normalize=settings.normalize,
        )
