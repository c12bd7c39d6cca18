"""Perceptrons side by side: against plain numpy, what each output depends on, and derivatives by the parameters."""

import numpy as np
import pytest
import torch

from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.training import LevenbergPlan, train_levenberg

BRANCHES = {"field": Branch((0,), 2, platform=False), "even": Branch((1, 3), 3), "odd": Branch((2,), 1)}


def network(taps=3, branches=BRANCHES):
    torch.manual_seed(0)
    module = AddedBranches(branches, taps).double()
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.normal_()
    return module


def windows(length=6, batch=2):
    return torch.randn(batch, 4, length, dtype=torch.double, generator=torch.Generator().manual_seed(1))


def by_hand(module, x, names, taps=3):
    """Each output from the samples k - 2, k - 1 and k of each column in turn, as a loop over rows."""
    weights = {name: tensor.detach().numpy() for name, tensor in module.state_dict().items()}
    x = x.numpy()
    out = np.zeros((len(x), x.shape[2] - taps + 1))
    for b in range(len(x)):
        for k in range(taps - 1, x.shape[2]):
            for name in names:
                inputs = np.concatenate([x[b, column, k - taps + 1 : k + 1] for column in BRANCHES[name].columns])
                first, last = f"perceptrons.{name}.0", f"perceptrons.{name}.2"
                hidden = np.tanh(weights[f"{first}.weight"] @ inputs + weights[f"{first}.bias"])
                out[b, k - taps + 1] += (weights[f"{last}.weight"] @ hidden + weights[f"{last}.bias"])[0]
    return out


@pytest.mark.parametrize("taps", [1, 3, 6])
def test_output_is_the_sum_of_the_perceptrons_on_their_taps(taps):
    module, x = network(taps), windows()
    got = module(x)
    assert got.shape == (2, 7 - taps)
    np.testing.assert_allclose(got.detach().numpy(), by_hand(module, x, list(BRANCHES), taps), rtol=1e-12, atol=1e-12)


def test_branches_of_the_field_are_no_part_of_the_platform():
    module, x = network(), windows()
    got = module.platform(x).detach().numpy()
    np.testing.assert_allclose(got, by_hand(module, x, ["even", "odd"]), rtol=1e-12, atol=1e-12)
    changed = x.clone()
    changed[:, 0] += 1.0
    assert torch.equal(module.platform(changed), module.platform(x))
    assert not torch.equal(module(changed), module(x))


def test_an_output_knows_its_own_samples_and_two_before_alone():
    module, x = network(), windows(8)
    before = module(x)
    for row in range(8):
        changed = x.clone()
        changed[:, :, row] += 1.0
        moved = (module(changed) != before).all(dim=0).tolist()
        # output i is that of sample i + 2
        assert moved == [row - 2 <= i <= row for i in range(6)]


def test_a_window_gives_what_longer_ones_give_at_its_end():
    module, x = network(), windows(8)
    torch.testing.assert_close(module(x[:, :, 2:5])[:, 0], module(x)[:, 2], rtol=1e-14, atol=1e-14)


def test_an_untrained_network_returns_zeros_and_can_learn():
    module, x = network(), windows()
    module.start_at_zero()
    assert not module(x).any()
    (module(x) - 1.0).pow(2).sum().backward()
    for name in BRANCHES:
        assert module.perceptrons[name][-1].weight.grad.abs().max() > 0.0


def test_rows_of_the_jacobian_by_the_closed_form():
    """dy/dv = a, dy/dc = 1, dy/db = (1 - a^2) v, dy/dW = (1 - a^2) v x^T with a = tanh(W x + b)."""
    module = network(branches={"one": Branch((1, 3), 3)})
    x = windows(3, batch=5)
    named = dict(module.named_parameters())

    def output(weights, window):
        return torch.func.functional_call(module, weights, (window[None],))[0]

    got = torch.func.vmap(torch.func.jacrev(output), (None, 0))(named, x)
    first, last = "perceptrons.one.0", "perceptrons.one.2"
    inputs = x[:, [1, 3]].flatten(1)
    a = torch.tanh(inputs @ named[f"{first}.weight"].T + named[f"{first}.bias"])
    slope = (1.0 - a**2) * named[f"{last}.weight"]
    torch.testing.assert_close(got[f"{last}.weight"][:, 0, 0], a)
    torch.testing.assert_close(got[f"{last}.bias"][:, 0], torch.ones(5, 1, dtype=torch.double))
    torch.testing.assert_close(got[f"{first}.bias"][:, 0], slope)
    torch.testing.assert_close(got[f"{first}.weight"][:, 0], slope[:, :, None] * inputs[:, None])


def test_levenberg_marquardt_finds_what_such_a_network_has_made():
    """To the last digits, from zeros; Adam would stop far above."""
    branches = {"even": Branch((1, 3), 2), "odd": Branch((2,), 1)}
    teacher, module, x = network(branches=branches), network(branches=branches), windows(3, batch=300)
    module.start_at_zero()
    with torch.no_grad():
        for parameter in teacher.parameters():
            parameter.mul_(0.5)
        target = teacher(x)
    plan = LevenbergPlan(60)
    outcome = train_levenberg(module, x, target, lambda m: float((m(x) - target).std()), plan)
    assert outcome.history[0][2] == pytest.approx(float(target.std()))
    assert outcome.best_value < 1e-6 * float(target.std())


def test_a_network_of_the_field_alone_is_refused():
    with pytest.raises(ValueError, match="none of the branches field models the platform"):
        AddedBranches({"field": Branch((0,), 2, platform=False)}, 1)
    with pytest.raises(ValueError, match=r"none of the branches \(none\)"):
        AddedBranches({}, 1)
