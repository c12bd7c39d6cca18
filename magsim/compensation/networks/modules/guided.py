"""Physics-guided network: a linear Tolles-Lawson part and a network beside it, after Drones 2026, 10(4), 252.

Of that paper's PG-TLNet only the abstract is public: branches that split the interference into "a physics-constrained
linear subspace and a nonlinear residual subspace". What is here is a reconstruction from these words. The second form,
a network that corrects each coefficient, is model 2d of MagNav.jl (Gnadt, MIT, 2022).
"""

from collections.abc import Sequence
from typing import Literal

import torch
from torch import Tensor, nn

Nonlinear = Literal["residual", "coefficients"]


class GuidedNet(nn.Module):
    """``columns . beta + network(inputs)``, or ``columns . (beta + network(inputs))``, sample by sample.

    Parameters
    ----------
    channels : int
    branches : sequence of sequences of int
        Places of the Tolles-Lawson columns among the inputs: permanent, induced, eddy currents. The linear part is a
        sum over them and knows no other input.
    hidden : sequence of int
        Sizes of the tanh layers of the network, which reads all inputs.
    nonlinear : {"residual", "coefficients"}
        Whether the network gives interference, or a correction to each coefficient.
    """

    def __init__(
        self,
        channels: int,
        branches: Sequence[Sequence[int]],
        *,
        hidden: Sequence[int] = (32, 32),
        nonlinear: Nonlinear = "residual",
    ) -> None:
        super().__init__()
        self.branches = tuple(tuple(branch) for branch in branches)
        self.linear = nn.ModuleList(nn.Linear(len(branch), 1, bias=False) for branch in self.branches)
        self.nonlinear = nonlinear
        parts: list[nn.Module] = []
        size = channels
        for width in hidden:
            parts += [nn.Linear(size, width), nn.Tanh()]
            size = width
        self.body = nn.Sequential(*parts)
        self.places = tuple(place for branch in self.branches for place in branch)
        self.head = nn.Linear(size, 1 if nonlinear == "residual" else len(self.places) + 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T)."""
        return sum(self.parts(x).values(), torch.zeros((), dtype=x.dtype, device=x.device))

    def parts(self, x: Tensor) -> dict[str, Tensor]:
        """Return the linear and the nonlinear part of the output, (B, T) each."""
        rows = x.transpose(1, 2)
        linear = torch.stack([layer(rows[:, :, places]).squeeze(2) for layer, places in self._pairs()]).sum(0)
        out = self.head(self.body(rows))
        if self.nonlinear == "residual":
            return {"linear": linear, "nonlinear": out.squeeze(2)}
        return {"linear": linear, "nonlinear": out[:, :, 0] + (out[:, :, 1:] * rows[:, :, self.places]).sum(2)}

    def _pairs(self) -> list[tuple[nn.Module, tuple[int, ...]]]:
        return list(zip(self.linear, self.branches, strict=True))

    def start_at_zero(self) -> None:
        """Set the coefficients and the last layer to zero, so that an untrained network returns zeros."""
        for layer in (*self.linear, self.head):
            assert isinstance(layer, nn.Linear)
            nn.init.zeros_(layer.weight)
        nn.init.zeros_(self.head.bias)
