"""The training loop."""

import math

import pytest
import torch

from magsim.errors import DataError, RequestError
from magsim.training import Checkpoint, Plan, freeze, project_conflicts, seeded, train


def line(seed=0):
    with seeded(seed):
        return torch.nn.Sequential(torch.nn.Linear(3, 8), torch.nn.Tanh(), torch.nn.Linear(8, 1))


def batch(generator):
    x = torch.randn(16, 3, generator=generator)
    return x, (x[:, :1] - 2.0 * x[:, 1:2])


def losses(module, data, _step):
    return [((module(data[0]) - data[1]) ** 2).mean()]


FIXED = batch(torch.Generator().manual_seed(99))


def measure(module):
    return losses(module, FIXED, 0)[0].item()


def run(module, plan, **options):
    return train(module, batch, losses, options.pop("measure", measure), plan, seed=5, **options)


class Stop(Exception):
    pass


def weights(module):
    return torch.nn.utils.parameters_to_vector(module.parameters()).detach().clone()


def test_learns_and_leaves_the_best_state():
    module = line()
    before = measure(module)
    outcome = run(module, Plan(300, 0.05, every=20, patience=100))
    assert outcome.best_value < 0.1 * before
    assert measure(module) == outcome.best_value == min(value for _, _, value in outcome.history)
    assert not module.training


def test_same_seed_same_weights_and_the_global_generator_is_left_alone():
    torch.manual_seed(1)
    expected = torch.rand(3)
    ends = []
    torch.manual_seed(1)
    for _ in range(2):
        module = line()
        run(module, Plan(30, 0.01, every=10))
        ends.append(weights(module))
    assert torch.equal(*ends)
    assert torch.equal(torch.rand(3), expected)


def test_step_zero_counts():
    module = line()
    start = weights(module)
    values = iter([1.0, *[2.0] * 100])
    outcome = run(module, Plan(100, 0.01, every=10, patience=3), measure=lambda _: next(values))
    assert (outcome.best_step, outcome.best_value, outcome.steps) == (0, 1.0, 30)
    assert torch.equal(weights(module), start)


def test_stops_after_patience_without_a_better_value():
    values = iter([5.0, 4.0, 3.0, *[3.5] * 100])
    outcome = run(line(), Plan(1000, 0.01, every=10, patience=4), measure=lambda _: next(values))
    assert (outcome.best_step, outcome.steps) == (20, 60)


def test_cosine_decay():
    plan = Plan(100, 0.2)
    assert [plan.rate(step) for step in (0, 50, 100)] == pytest.approx([0.2, 0.1, 0.0])
    assert Plan(100, 0.2, decay=False).rate(70) == 0.2


@pytest.mark.parametrize("stop", [10, 20, 40])
def test_resumed_run_ends_as_an_uninterrupted_one(tmp_path, stop):
    plan = Plan(60, 0.01, every=10, patience=100)
    whole = line()
    expected = run(whole, plan)

    def broken(progress):
        if progress.step == stop:
            raise Stop

    with pytest.raises(Stop):
        run(line(), plan, progress=broken, checkpoint=Checkpoint(tmp_path, "a"))
    assert len(list(tmp_path.iterdir())) == 3
    resumed = line(seed=1)  # start weights do not matter any more
    steps = []
    outcome = run(
        resumed, plan, progress=lambda progress: steps.append(progress.step), checkpoint=Checkpoint(tmp_path, "a")
    )
    assert steps[0] == stop  # where it stands
    assert repr(outcome) == repr(expected)
    assert torch.equal(weights(resumed), weights(whole))
    assert run(line(2), plan, checkpoint=Checkpoint(tmp_path, "a")).steps == 60


def test_checkpoints_that_cannot_be_used_are_refused(tmp_path):
    plan = Plan(20, 0.01, every=10)
    run(line(), plan, checkpoint=Checkpoint(tmp_path, "a"))
    with pytest.raises(RequestError, match="other settings"):
        run(line(), plan, checkpoint=Checkpoint(tmp_path, "b"))
    with pytest.raises(
        DataError,
        match=r"step_00000020\.safetensors cannot be taken up: the weights do not fit the network: they lack",
    ):
        run(torch.nn.Linear(3, 1), plan, checkpoint=Checkpoint(tmp_path, "a"))
    wider = torch.nn.Sequential(torch.nn.Linear(3, 9), torch.nn.Tanh(), torch.nn.Linear(9, 1))
    with pytest.raises(DataError, match=r"0\.weight has shape \(8, 3\), and \(9, 3\) in the network"):
        run(wider, plan, checkpoint=Checkpoint(tmp_path, "a"))
    for path in tmp_path.glob("*.pt"):
        path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(DataError, match="is broken"):
        run(line(), plan, checkpoint=Checkpoint(tmp_path, "a"))


def test_divergence_is_reported():
    values = iter([1.0, math.nan])
    with pytest.raises(DataError, match="the validation value at step 10 is nan; the weights of step 0, the best, are"):
        run(line(), Plan(100, 0.01, every=10), measure=lambda _: next(values))
    with pytest.raises(DataError, match=r"training diverged: the validation value at step 0 is inf$"):
        run(line(), Plan(100, 0.01, every=10), measure=lambda _: math.inf)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_loss_that_is_not_finite_leaves_the_best_weights_and_a_usable_checkpoint(tmp_path, bad):
    def fails(module, data, step):
        return [losses(module, data, step)[0] * (bad if step == 35 else 1.0)]

    def go(module):
        plan = Plan(60, 0.01, every=10)
        train(module, batch, fails, measure, plan, seed=5, checkpoint=Checkpoint(tmp_path, "a"))

    best = line()
    run(best, Plan(60, 0.01, every=10), progress=None, measure=measure_until(30))
    message = f"the loss at step 35 is {bad}; the weights of step 30, the best, are kept"
    for start in (0, 1):  # the second takes up the checkpoint
        module = line(start)
        with pytest.raises(DataError, match=message):
            go(module)
        assert torch.equal(weights(module), weights(best))
        assert not module.training
    assert Checkpoint(tmp_path, "a").load().step == 30


def measure_until(step):
    """Measure, and find everything after a step worse."""
    number = iter(range(0, 1000, 10))
    return lambda module: measure(module) if next(number) <= step else 1e9


def test_a_derivative_that_is_not_finite_is_found_before_anything_is_measured_or_saved(tmp_path):
    class Steep(torch.autograd.Function):
        @staticmethod
        def forward(context, x):
            return x.clone()

        @staticmethod
        def backward(context, gradient):
            return gradient * math.nan

    def steep(module, data, step):
        loss = losses(module, data, step)[0]
        return [Steep.apply(loss) if step == 19 else loss]

    module = line()
    with pytest.raises(DataError, match=r"0\.weight is not finite after 20 steps; the weights of step 10, the be"):
        train(module, batch, steep, measure, Plan(60, 0.01, every=10), seed=5, checkpoint=Checkpoint(tmp_path, "a"))
    assert weights(module).isfinite().all()
    assert Checkpoint(tmp_path, "a").load().step == 10


@pytest.mark.parametrize("stop", [13, 25])
def test_a_state_that_was_saved_between_validations_is_taken_up(tmp_path, stop):
    """Dropout draws from torch's own generator, whose state is kept too."""

    def noisy(seed=0):
        with seeded(seed):
            return torch.nn.Sequential(torch.nn.Linear(3, 8), torch.nn.Dropout(0.3), torch.nn.Linear(8, 1))

    def breaks(module, data, step):
        if step == stop:
            raise Stop
        return losses(module, data, step)

    plan, seen = Plan(40, 0.01, every=10, patience=100), []
    whole, resumed = noisy(), noisy(1)
    expected = run(whole, plan)
    often = Checkpoint(tmp_path, "a", every_s=0.0)
    with pytest.raises(Stop):
        train(noisy(), batch, breaks, measure, plan, seed=5, checkpoint=often)
    assert Checkpoint(tmp_path, "a").load().step == stop
    outcome = run(resumed, plan, progress=seen.append, checkpoint=Checkpoint(tmp_path, "a"))
    assert [p.step for p in seen] == list(range(stop // 10 * 10, 50, 10))
    assert repr(outcome) == repr(expected)
    assert torch.equal(weights(resumed), weights(whole))


def test_frozen_parameters_stay():
    module = line()
    freeze(module, ["0.*"])
    before = {name: tensor.clone() for name, tensor in module.state_dict().items()}
    run(module, Plan(20, 0.05, every=10))
    changed = {name for name, tensor in module.state_dict().items() if not torch.equal(tensor, before[name])}
    assert changed == {"2.weight", "2.bias"}


def test_progress_has_loss_value_and_remaining_time():
    seen = []
    run(line(), Plan(40, 0.01, every=10), phase="fit", progress=seen.append)
    assert [p.step for p in seen] == [0, 10, 20, 30, 40]
    assert all(p.phase == "fit" and p.steps == 40 for p in seen)
    assert math.isnan(seen[0].loss)
    assert all(p.loss > 0.0 and p.eta_s >= 0.0 for p in seen[1:])
    assert seen[-1].eta_s == 0.0


def test_surgery_gives_the_parameters_the_merged_gradient():
    """Two losses on one weight vector, against one step of Adam's direction by hand: the sign of the gradient."""
    module = torch.nn.Linear(2, 1, bias=False)
    with torch.no_grad():
        module.weight.copy_(torch.tensor([[0.0, 0.0]]))
    g1, g2 = torch.tensor([1.0, 0.1]), torch.tensor([-3.0, 0.1])
    # added: (-2, 0.2); projected: g1 is freed from g2 and g2 from g1, and both components are positive
    merged = project_conflicts([g1, g2])
    assert merged[0] * (g1 + g2)[0] < 0.0 or merged[1] > (g1 + g2)[1]

    def two(m, _data, _step):
        return [(m.weight[0] * g1).sum(), (m.weight[0] * g2).sum()]

    values = iter([1.0, 0.0])
    plan = Plan(1, 0.1, decay=False, every=1, surgery=True)
    train(module, batch, two, lambda _: next(values), plan, seed=0)
    torch.testing.assert_close(module.weight[0].detach(), -0.1 * torch.sign(merged), rtol=1e-4, atol=1e-6)


def test_surgery_takes_gradients_in_any_memory_order():
    module = torch.nn.Linear(2, 3, bias=False)
    product = torch.randn(2, 3, generator=torch.Generator().manual_seed(0))

    def two(m, _data, _step):
        return [(m.weight.t() * product).sum(), (m.weight.t() ** 2 * product).sum()]

    gradient = torch.autograd.grad(two(module, None, 0)[1], module.weight)[0]
    assert not gradient.is_contiguous()
    start = weights(module)
    values = iter([1.0, 0.0])
    train(module, batch, two, lambda _: next(values), Plan(1, 0.1, every=1, surgery=True), seed=0)
    assert not torch.equal(weights(module), start)
