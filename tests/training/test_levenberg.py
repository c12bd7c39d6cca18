"""Levenberg-Marquardt: against scipy's, against closed forms, and as a training run."""

import itertools
import math

import pytest
import torch
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits
from torch import nn

from magsim.compensation.networks.modules.perceptrons import SampleMLP, WindowMLP
from magsim.errors import DataError, RequestError
from magsim.training import Checkpoint, LevenbergPlan, seeded, train_levenberg
from magsim.training.least_squares import SquaredErrors
from tests.support.recurrent import LastOfRecurrent

ROWS = 400
MODULES = {
    "samples": (lambda: WindowMLP(3, 1, (4,), "tanh"), 3, 1),
    "windows": (lambda: WindowMLP(2, 3, (3,), "tanh"), 2, 3),
    "two layers": (lambda: SampleMLP(3, (4, 3), "tanh"), 3, 1),
    "GELU": (lambda: WindowMLP(2, 2, (2,), "gelu"), 2, 2),
    "LSTM": (lambda: LastOfRecurrent("LSTM", 2, 1), 2, 4),
}


def problem(kind, *, away=0.1, noise=0.05):
    """Network near that which made its noisy targets: a minimum close by, and not zero."""
    make, channels, rows = MODULES[kind]
    generator = torch.Generator().manual_seed(0)
    with seeded(0):
        module = make().double()
    inputs = torch.randn(ROWS, channels, rows, generator=generator, dtype=torch.float64)
    with torch.no_grad():
        for parameter in module.parameters():
            parameter.mul_(2.0)
        targets = module(inputs)
        targets += noise * targets.std() * torch.randn(targets.shape, generator=generator, dtype=torch.float64)
        for parameter in module.parameters():
            parameter.add_(away * torch.randn(parameter.shape, generator=generator, dtype=torch.float64))
    return module, inputs, targets


def mean_square(inputs, targets):
    return lambda module: ((module(inputs.to(next(module.parameters()).dtype)) - targets) ** 2).mean().item()


def falling():
    """Validation value that is always better, so that the last weights are kept."""
    values = itertools.count(0.0, -1.0)
    return lambda _: next(values)


def run(problem, plan, **options):
    module, inputs, targets = problem
    measure = options.pop("measure", mean_square(inputs, targets))
    return train_levenberg(module, inputs, targets, measure, plan, **options)


def weights(module):
    return torch.nn.utils.parameters_to_vector(module.parameters()).detach().clone()


@pytest.mark.parametrize("kind", MODULES)
def test_minimum_is_that_of_scipy(kind):
    module, inputs, targets = problem(kind)
    squares = SquaredErrors(module, inputs, targets)
    found = least_squares(
        lambda w: (squares.jacobian(torch.from_numpy(w), inputs)[0] - targets).numpy().ravel(),
        squares.start.numpy(),
        lambda w: squares.jacobian(torch.from_numpy(w), inputs)[1].flatten(0, 1).numpy(),
        method="lm",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    assert found.cost < 0.9 * squares.value(squares.start) / 2.0
    outcome = run((module, inputs, targets), LevenbergPlan(300, patience=300))
    assert outcome.best_value * targets.numel() / 2.0 == pytest.approx(found.cost, rel=1e-6)
    theirs = squares.jacobian(torch.from_numpy(found.x), inputs)[0]
    torch.testing.assert_close(module(inputs), theirs, rtol=0.0, atol=1e-6 * float(targets.std()))


def test_a_linear_network_is_solved_in_one_step():
    """The solution is that of least squares; with a decay and weights, that of weighted ridge regression."""
    module = nn.Sequential(nn.Flatten(), nn.Linear(4, 1)).double()
    generator = torch.Generator().manual_seed(4)
    inputs = torch.randn(50, 4, 1, generator=generator, dtype=torch.float64)
    targets = torch.randn(50, 1, generator=generator, dtype=torch.float64)
    design = torch.cat([inputs[:, :, 0], torch.ones(50, 1, dtype=torch.float64)], dim=1)
    row_weights = torch.linspace(0.5, 3.0, 50, dtype=torch.float64)
    for weight, decay in ((torch.ones_like(row_weights), 0.0), (row_weights, 0.1)):
        left = design.T @ (weight[:, None] * design) + decay * weight.sum() * torch.eye(5, dtype=torch.float64)
        expected = torch.linalg.solve(left, design.T @ (weight * targets[:, 0]))
        plan = LevenbergPlan(1, damping=1e-12, weight_decay=decay)
        run((module, inputs, targets), plan, weights=weight[:, None], measure=falling())
        torch.testing.assert_close(weights(module), expected, rtol=1e-9, atol=1e-12)


def test_an_operator_weighs_what_it_passes():
    """With differences of neighbors as operator, a constant error counts nothing: the bias is not learned."""
    module = nn.Sequential(nn.Flatten(), nn.Linear(2, 1)).double()
    inputs = torch.randn(40, 2, 1, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
    targets = inputs[:, :1, 0] - 3.0 * inputs[:, 1:, 0] + 7.0
    differences = torch.tensor([[-1.0, 1.0, 0.0, 0.0], [0.0, -1.0, 1.0, 0.0], [0.0, 0.0, -1.0, 1.0]])
    nn.init.zeros_(module[1].bias)
    run((module, inputs, targets), LevenbergPlan(5), operator=differences, measure=falling())
    expected = torch.tensor([1.0, -3.0, 0.0], dtype=torch.float64)
    torch.testing.assert_close(weights(module), expected, atol=1e-6, rtol=0.0)


def test_the_loss_falls_at_each_step_and_the_best_state_is_kept():
    module, inputs, targets = problem("samples", away=0.5)
    seen = []
    values = iter([5.0, 4.0, 3.0, *[3.5] * 100])
    kept = []

    def measure(module):
        kept.append(weights(module))
        return next(values)

    outcome = run((module, inputs, targets), LevenbergPlan(50, patience=4), measure=measure, progress=seen.append)
    losses = [loss for _, loss, _ in outcome.history]
    assert losses == sorted(losses, reverse=True)
    assert losses[0] == pytest.approx(mean_square(inputs, targets)(problem("samples", away=0.5)[0]), rel=1e-12)
    assert (outcome.best_step, outcome.best_value, outcome.steps) == (2, 3.0, 6)
    assert torch.equal(weights(module), kept[2])
    assert not module.training
    assert [p.step for p in seen] == list(range(7))
    assert math.isnan(seen[0].eta_s)
    assert seen[-1].eta_s == 0.0


def test_step_zero_counts():
    module, inputs, targets = problem("samples")
    start = weights(module)
    values = iter([1.0, *[2.0] * 100])
    outcome = run((module, inputs, targets), LevenbergPlan(100, every=2, patience=3), measure=lambda _: next(values))
    assert (outcome.best_step, outcome.best_value, outcome.steps) == (0, 1.0, 6)
    assert torch.equal(weights(module), start)


@pytest.mark.parametrize("end", [{"goal": 0.01}, {"least_gradient": 1e-2}, {"most_damping": 1e10}])
def test_training_ends_where_nothing_is_left_to_do(end):
    module, inputs, targets = problem("samples", noise=0.0 if "goal" in end else 0.05)
    outcome = run((module, inputs, targets), LevenbergPlan(500, every=7, patience=500, **end))
    assert 0 < outcome.steps < 100
    assert outcome.history[-1][0] == outcome.steps
    squares = SquaredErrors(module, inputs, targets)
    if "goal" in end:
        assert outcome.best_value <= 0.01 < outcome.history[0][1]
    else:
        assert float(squares.normal(squares.start).gradient.norm()) <= 1e-2


@pytest.mark.parametrize("stop", [0, 2, 6])
def test_resumed_run_ends_as_an_uninterrupted_one(tmp_path, stop):
    plan = LevenbergPlan(12, every=2, patience=100)
    whole = problem("two layers", away=0.5)
    expected = run(whole, plan)

    class Stop(Exception):
        pass

    def broken(progress):
        if progress.step == stop:
            raise Stop

    with pytest.raises(Stop):
        run(problem("two layers", away=0.5), plan, progress=broken, checkpoint=Checkpoint(tmp_path, "a"))
    resumed = problem("two layers", away=1.0)  # start weights do not matter any more
    steps = []
    outcome = run(resumed, plan, progress=lambda p: steps.append(p.step), checkpoint=Checkpoint(tmp_path, "a"))
    assert steps[0] == stop  # where it stands
    assert repr(outcome) == repr(expected)
    assert torch.equal(weights(resumed[0]), weights(whole[0]))
    with pytest.raises(DataError, match="weights do not fit the network"):
        run(problem("windows"), plan, checkpoint=Checkpoint(tmp_path, "a"))


def test_a_float32_network_resumes_in_float64(tmp_path):
    plan = LevenbergPlan(8, patience=100)

    def single():
        module, inputs, targets = problem("samples", away=0.5)
        return module.float(), inputs, targets

    whole = single()
    run(whole, plan)
    assert whole[0].layers[0].weight.dtype == torch.float32

    class Stop(Exception):
        pass

    def broken(progress):
        if progress.step == 3:
            raise Stop

    with pytest.raises(Stop):
        run(single(), plan, progress=broken, checkpoint=Checkpoint(tmp_path, "a"))
    resumed = single()
    run(resumed, plan, checkpoint=Checkpoint(tmp_path, "a"))
    assert torch.equal(weights(resumed[0]), weights(whole[0]))


def test_same_weights_on_any_number_of_threads():
    ends = []
    for threads in (1, 2):
        found = problem("two layers", away=0.5)
        with threadpool_limits(threads):
            run(found, LevenbergPlan(8, patience=100, threads=threads))
        ends.append(weights(found[0]))
    assert torch.equal(*ends)


def test_frozen_parameters_stay():
    module, inputs, targets = problem("two layers", away=0.5)
    module.layers[0].requires_grad_(False)
    before = weights(module)
    outcome = run((module, inputs, targets), LevenbergPlan(5, patience=100))
    assert outcome.best_value < outcome.history[0][2]
    assert torch.equal(weights(module)[:16], before[:16])
    assert not torch.any(weights(module)[16:] == before[16:])


def test_too_many_parameters_and_none_are_refused():
    inputs, targets = torch.zeros(4, 1, 1), torch.zeros(4, 1)
    with pytest.raises(RequestError, match="networks of 1 to 5000 parameters; WindowMLP has 5002"):
        run((WindowMLP(1, 1, (1667,)), inputs, targets), LevenbergPlan(1))
    with pytest.raises(RequestError, match="Linear has 0"):
        run((nn.Linear(1, 1).requires_grad_(False), inputs, targets), LevenbergPlan(1))


def test_divergence_is_reported_and_the_best_weights_are_kept():
    found = problem("samples", away=0.5)
    values, kept = iter([3.0, 2.0, math.nan]), []

    def measure(module):
        kept.append(weights(module))
        return next(values)

    with pytest.raises(DataError, match="the validation value at step 2 is nan"):
        run(found, LevenbergPlan(10), measure=measure)
    assert torch.equal(weights(found[0]), kept[1])
    module, inputs, targets = problem("samples")
    targets[3] = math.inf
    with pytest.raises(DataError, match="the loss at step 0 is inf"):
        run((module, inputs, targets), LevenbergPlan(10))


def test_a_derivative_that_is_not_finite_is_reported():
    class Root(nn.Module):
        def __init__(self):
            super().__init__()
            self.a = nn.Parameter(torch.tensor(0.0))

        def forward(self, x):
            return torch.sqrt(self.a * x[:, :, 0])

    with pytest.raises(DataError, match="a derivative of the outputs at step 0 is not finite"):
        run((Root(), torch.ones(3, 1, 1), torch.ones(3, 1)), LevenbergPlan(10))
