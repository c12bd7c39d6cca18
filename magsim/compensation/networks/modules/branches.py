"""Small perceptrons side by side, each on columns of its own, whose outputs are added up.

The form of WilliamsNN (papers 000 and Williams 1993) and of the sub-networks of paper 004. Some branches may model the
Earth's field: they are fitted with the others and belong to no aircraft.
"""

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn


class Branch(NamedTuple):
    """One perceptron.

    Attributes
    ----------
    columns : tuple of int
        Places of its input columns.
    hidden : int
    platform : bool
        Whether it models the aircraft: only such branches are part of what is subtracted.
    """

    columns: tuple[int, ...]
    hidden: int
    platform: bool = True


class AddedBranches(nn.Module):
    """Sum of perceptrons with one hidden layer of tanh, each on the last ``taps`` samples of its own columns.

    Parameters
    ----------
    branches : mapping of str to Branch
    taps : int
        Samples that an output is made from: its own and those before it.

    Raises
    ------
    ValueError
        If there is no branch, or none of the platform.
    """

    def __init__(self, branches: Mapping[str, Branch], taps: int) -> None:
        super().__init__()
        self.platform_branches = tuple(name for name, branch in branches.items() if branch.platform)
        if not self.platform_branches:
            msg = f"none of the branches {', '.join(branches) or '(none)'} models the platform"
            raise ValueError(msg)
        self.taps = taps
        self.columns = {name: list(branch.columns) for name, branch in branches.items()}
        self.perceptrons = nn.ModuleDict(
            {name: _perceptron(taps * len(branch.columns), branch.hidden) for name, branch in branches.items()}
        )

    def forward(self, x: Tensor) -> Tensor:
        """Map windows (B, M, T) to (B, T - taps + 1): one output for each of the last samples."""
        return self._sum(x, tuple(self.columns))

    def platform(self, x: Tensor) -> Tensor:
        """Return the platform's part of ``forward``."""
        return self._sum(x, self.platform_branches)

    def alone(self, name: str) -> nn.Module:
        """Return one branch as a network of its own, on the same windows; it shares the weights."""
        return _Alone(self, name)

    def _sum(self, x: Tensor, names: tuple[str, ...]) -> Tensor:
        # (B, M, K, taps): the taps of each output, the oldest first
        taps = x.unfold(2, self.taps, 1)
        parts = [self.perceptrons[name](taps[:, self.columns[name]].transpose(1, 2).flatten(2)) for name in names]
        return torch.stack(parts).sum(dim=0).squeeze(2)

    def start_at_zero(self) -> None:
        """Set the last layers to zero, so that an untrained network returns zeros."""
        for perceptron in self.perceptrons.values():
            assert isinstance(perceptron, nn.Sequential)
            for parameter in perceptron[-1].parameters():
                nn.init.zeros_(parameter)


class _Alone(nn.Module):
    """One branch of a sum."""

    def __init__(self, whole: AddedBranches, name: str) -> None:
        super().__init__()
        self.whole, self.branch = whole, name

    def forward(self, x: Tensor) -> Tensor:
        return self.whole._sum(x, (self.branch,))


def _perceptron(inputs: int, hidden: int) -> nn.Sequential:
    """Return inputs - hidden tanh - 1, started small enough that no unit is saturated by standardized inputs."""
    first, last = nn.Linear(inputs, hidden), nn.Linear(hidden, 1)
    nn.init.normal_(first.weight, std=0.5 / inputs**0.5)
    nn.init.normal_(first.bias, std=0.3)
    nn.init.normal_(last.weight, std=hidden**-0.5)
    nn.init.zeros_(last.bias)
    return nn.Sequential(first, nn.Tanh(), last)
