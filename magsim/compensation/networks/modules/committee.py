"""Several networks as one: their mean."""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor, nn


class Committee(nn.Module):
    """The mean of networks of one form, trained on different rows.

    Where they extrapolate they disagree, and the mean errs less than most of them (Krogh and Vedelsby, Neural network
    ensembles, cross validation, and active learning, NIPS 1994).

    Parameters
    ----------
    members : sequence of nn.Module
    """

    def __init__(self, members: Sequence[nn.Module]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)

    def forward(self, x: Tensor) -> Tensor:
        """Map windows as the members do."""
        return self._mean(x, lambda member: member)

    def platform(self, x: Tensor) -> Tensor:
        """Return the platform's part of the output."""
        return self._mean(x, lambda member: getattr(member, "platform", member))

    def _mean(self, x: Tensor, part: Callable[[nn.Module], Callable[[Tensor], Tensor]]) -> Tensor:
        return torch.stack([part(member)(x) for member in self.members]).mean(dim=0)
