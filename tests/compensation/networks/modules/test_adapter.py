"""A module of anybody's own: its outputs in one shape, times one number, and its platform's part."""

import pytest
import torch

from magsim.compensation.networks.modules.adapter import Adapter
from magsim.compensation.networks.modules.branches import AddedBranches, Branch


class Sums(torch.nn.Module):
    """Sum over channels at each time, (b, 1, t); the first channel is the field's."""

    def forward(self, x):
        return x.sum(dim=1, keepdim=True)

    def platform(self, x):
        return x[:, 1:].sum(dim=1, keepdim=True)


class Plain(torch.nn.Module):
    def forward(self, x):
        return x.sum(dim=(1, 2))


@pytest.fixture
def x():
    return torch.randn(2, 3, 5, generator=torch.Generator().manual_seed(0))


def test_outputs_are_those_of_the_module_times_one_number(x):
    adapter = Adapter(Sums())
    assert not adapter(x).any()
    with torch.no_grad():
        adapter.gain.fill_(2.0)
    torch.testing.assert_close(adapter(x), 2.0 * x.sum(dim=1))
    torch.testing.assert_close(adapter.platform(x), 2.0 * (x[:, 1] + x[:, 2]))
    adapter.start_at_zero()
    assert not adapter(x).any()


def test_a_module_without_a_part_for_the_field_is_all_platform(x):
    adapter = Adapter(Plain())
    with torch.no_grad():
        adapter.gain.fill_(1.0)
    assert adapter(x).shape == (2, 1)
    assert torch.equal(adapter.platform(x), adapter(x))


def test_a_module_that_starts_at_zero_by_itself_has_no_number(x):
    branches = AddedBranches({"field": Branch((0,), 2, platform=False), "own": Branch((1, 2), 2)}, 1)
    adapter = Adapter(branches)
    assert adapter.gain is None
    assert torch.equal(adapter.platform(x), branches.platform(x))
    assert not torch.equal(adapter.platform(x), adapter(x))
    adapter.start_at_zero()
    assert not adapter(x).any()
