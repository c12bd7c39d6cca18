"""A torch module of anybody's own as the trainer takes it: it returns zeros before it is trained."""

import torch
from torch import Tensor, nn


class Adapter(nn.Module):
    """A module times one number that starts at 0 and is learned with it, unless it starts at zero by itself.

    The factor leaves every path to the module's weights open once it has moved by a step (Bachlechner et al., ReZero
    is all you need, UAI 2021), whatever the last layer is.

    Parameters
    ----------
    module : nn.Module
        Maps windows (b, c, t) to (b, k), (b, 1, k), or (b,) where k is 1. If it has a method ``start_at_zero``, that
        sets its outputs to zero, and there is no factor.
    """

    def __init__(self, module: nn.Module) -> None:
        super().__init__()
        self.module = module
        self.gain = None if hasattr(module, "start_at_zero") else nn.Parameter(torch.zeros(()))

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (b, c, t) to (b, k)."""
        return self._scaled(self.module(x))

    def platform(self, x: Tensor) -> Tensor:
        """Return what the module says of the platform alone; all, if it has no method ``platform``."""
        return self._scaled(getattr(self.module, "platform", self.module)(x))

    def _scaled(self, out: Tensor) -> Tensor:
        out = out.reshape(len(out), -1)
        return out if self.gain is None else self.gain * out

    def start_at_zero(self) -> None:
        """Make the untrained network return zeros."""
        if self.gain is None:
            self.module.start_at_zero()  # type: ignore[operator]
        else:
            nn.init.zeros_(self.gain)
