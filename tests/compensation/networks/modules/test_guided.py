"""The physics-guided network: its linear part is Tolles-Lawson, its other part what the setting says."""

import pytest
import torch

from magsim.compensation.networks.counting import multiply_accumulates, parameters
from magsim.compensation.networks.modules.guided import GuidedNet

BRANCHES = ((0, 1, 2), (4, 5))


@pytest.fixture(autouse=True)
def _seed():
    with torch.random.fork_rng():
        torch.manual_seed(0)
        yield


@pytest.mark.parametrize(("nonlinear", "outputs"), [("residual", 1), ("coefficients", 6)])
def test_sizes_and_zero_start(nonlinear, outputs):
    module = GuidedNet(7, BRANCHES, hidden=(4, 3), nonlinear=nonlinear)
    assert parameters(module) == 5 + (7 + 1) * 4 + (4 + 1) * 3 + (3 + 1) * outputs
    assert multiply_accumulates(module, 7, 10) == 10 * (5 + 7 * 4 + 4 * 3 + 3 * outputs)
    x = torch.randn(2, 7, 10)
    assert module(x).shape == (2, 10)
    assert module(x).abs().max() > 0.01
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).square().sum().backward()
    assert all(layer.weight.grad.abs().max() > 0.0 for layer in (*module.linear, module.head))


@pytest.mark.parametrize("nonlinear", ["residual", "coefficients"])
def test_output_by_hand(nonlinear):
    module = GuidedNet(7, BRANCHES, hidden=(4,), nonlinear=nonlinear).double()
    x = torch.randn(1, 7, 5, dtype=torch.float64)
    beta = torch.cat([layer.weight[0] for layer in module.linear])
    first, head = module.body[0], module.head
    for row in range(5):
        values = x[0, :, row]
        terms = values[[0, 1, 2, 4, 5]]
        net = head.weight @ torch.tanh(first.weight @ values + first.bias) + head.bias
        expected = terms @ beta + net[0] if nonlinear == "residual" else terms @ (beta + net[1:]) + net[0]
        torch.testing.assert_close(module(x)[0, row], expected)


def test_the_linear_part_knows_no_other_input():
    module = GuidedNet(7, BRANCHES).double()
    x = torch.randn(1, 7, 5, dtype=torch.float64)
    changed = x.clone()
    changed[:, [3, 6]] += 1.0
    assert torch.equal(module.parts(changed)["linear"], module.parts(x)["linear"])
    assert not torch.isclose(module.parts(changed)["nonlinear"], module.parts(x)["nonlinear"]).any()
