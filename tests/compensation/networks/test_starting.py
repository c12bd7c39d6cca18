"""Training that starts from another run."""

import numpy as np
import pytest
import torch

from magsim.compensation import FitContext, create
from magsim.errors import RequestError
from tests.support.worlds import World, calibration

QUICK = {"steps": 4, "every": 2, "batch": 4, "hidden": (4,), "folds": 0, "learning_rate": 0.01, "first_stage": "none"}
QUICK |= {"optimizer": "adam", "weight_decay": 0.0}


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=1))


@pytest.fixture(scope="module")
def first(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("first")
    method = create("bp", **QUICK).fit(recording)
    method.save(folder)
    return folder, method


def weights(method):
    return method._fitted.module.state_dict()


def adapted(recording, folder, *freeze, **params):
    return create("bp", **QUICK | params).fit(recording, context=FitContext(seed=1, init=folder, freeze=freeze))


def test_weights_and_scales_are_those_of_the_run_and_the_rest_is_trained(recording, first):
    folder, before = first
    (frozen, *others) = [name for name, _ in before._fitted.module.named_parameters()]
    after = adapted(recording.take(slice(0, 3200)), folder, frozen, steps=40, every=20)
    assert before.outcomes_["all"].best_step > 0
    assert after.outcomes_["all"].best_step > 0
    assert torch.equal(weights(after)[frozen], weights(before)[frozen])
    assert any(not torch.equal(weights(after)[name], weights(before)[name]) for name in others)
    assert after._fitted.scale == before._fitted.scale
    assert (after._fitted.standardizer.mean == before._fitted.standardizer.mean).all()
    assert after._fitted.mean != before._fitted.mean


def test_a_start_that_no_step_makes_better_is_used_as_it_is(recording, first):
    """Steps of 1e-9 make nothing better by more than rounding; without a start, the network would give zeros."""
    folder, before = first
    after = adapted(recording, folder, folds=2, shrink=False, learning_rate=1e-9, steps=1, every=1)
    assert after._fitted.weight == 1.0
    estimates = [method.interference(recording) for method in (before, after)]
    assert np.abs(estimates[0] - estimates[0].mean()).max() > 0.1
    np.testing.assert_allclose(*(estimate - estimate.mean() for estimate in estimates), rtol=0, atol=1e-3)


def test_a_checkpoint_belongs_to_what_it_started_from(recording, first, tmp_path):
    class Broken(Exception):
        pass

    def breaks(_progress):
        raise Broken

    folder, _ = first
    with pytest.raises(Broken):
        create("bp", **QUICK).fit(recording, context=FitContext(1, breaks, tmp_path, init=folder))
    with pytest.raises(RequestError, match="belongs to a run with other settings"):
        create("bp", **QUICK).fit(recording, context=FitContext(1, None, tmp_path))


def test_runs_that_do_not_fit_are_refused(recording, first, tmp_path):
    folder, _ = first
    with pytest.raises(RequestError, match=r"init .*: the weights do not fit the network: .* has shape"):
        adapted(recording, folder, hidden=(5,))
    with pytest.raises(RequestError, match="reads other inputs or another rate"):
        adapted(recording, folder, inputs=("attitude",))
    with pytest.raises(RequestError, match="freeze 'x' fits no parameter"):
        adapted(recording, folder, "x")
    create("tl16").fit(recording).save(tmp_path)
    with pytest.raises(RequestError, match="holds no network to start from"):
        adapted(recording, tmp_path)
