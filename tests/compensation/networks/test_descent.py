"""The optimizers of networks: what they are given, and what they refuse."""

import numpy as np
import pytest
import torch

from magsim.compensation import create, load
from magsim.errors import RequestError
from magsim.training import least_squares
from tests.support import scores
from tests.support.worlds import World, calibration

PAPER = World(eddy_tau_s=0.01)
LM = {"optimizer": "lm", "every": 1, "band_weight": 0.0}


@pytest.fixture(scope="module")
def recording():
    return calibration(PAPER)


def test_levenberg_marquardt_beats_the_stage_in_a_few_epochs(recording):
    test = recording.where(split="test")
    truth = test["interference_cabin_nt"]
    method = create("bp", hidden=(8,), steps=15, folds=3, refit=False, weight_decay=1e-4, **LM).fit(recording)
    ratios = [
        scores.improvement_ratio(truth, truth - estimate, 10.0)
        for estimate in (method._fitted.stage.interference(test), method.interference(test))
    ]
    assert ratios[1] > 1.5 * ratios[0]


def test_all_learned_rows_are_given_once_and_no_other(recording, monkeypatch):
    """Of a network with a context of 3 rows: windows that end at each row, what the stage leaves there."""
    given = []
    whole = least_squares.SquaredErrors

    def spy(module, inputs, targets, *, weights, operator, decay):
        given.append((inputs, targets, weights, operator))
        return whole(module, inputs, targets, weights=weights, operator=operator, decay=decay)

    monkeypatch.setattr("magsim.training.levenberg.SquaredErrors", spy)
    flight = recording.where(split="train")
    method = create("subnetworks", steps=1, folds=2, refit=False, **LM).fit(flight)
    fitted = method._fitted
    inputs, rest = fitted.inputs(flight), fitted.rest(flight, "cabin") / fitted.scale
    assert len(given) == 2
    row_of = {value: row for row, value in enumerate(rest)}
    rows = [[row_of[float(target)] for target in targets] for _, targets, _, _ in given]
    for (windows, _, weights, operator), numbers in zip(given, rows, strict=True):
        assert windows.dtype == torch.float64
        np.testing.assert_array_equal(windows[1000].numpy(), inputs[numbers[1000] - 2 : numbers[1000] + 1].T)
        assert weights.min() == weights.max() == 1.0
        assert operator is None
    # rows near a border of the folds are learned by neither; no row is learned by both
    assert len(set(rows[0])) == len(rows[0])
    assert set(rows[0]).isdisjoint(rows[1])
    assert len(rows[0]) + len(rows[1]) > 0.4 * len(flight)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("bp", {"hidden": (4,)}),
        ("bpnn", {"window": 5, "hidden": (3,)}),
        ("magtcn", {"width": 1, "kernel": 3, "expansion": 1, "window": 130, "inputs": ("attitude",)}),
    ],
)
def test_every_small_network_may_learn_in_band_by_levenberg_marquardt(recording, name, settings):
    """One row from itself, one from a window, and a window from a window."""
    settings = LM | {"band_weight": 1.0, "first_stage": "none", "steps": 2, "folds": 0} | settings
    method = create(name, **settings).fit(recording.take(slice(0, 900)))
    losses = [loss for _, loss, _ in method.outcomes_["all"].history]
    assert len(losses) == 3
    assert losses[2] < losses[1] < losses[0]


def test_sub_networks_need_no_stage(recording):
    """Paper 004 has none; the goal is 300."""
    test = recording.where(split="test")
    truth = test["interference_cabin_nt"]
    settings = LM | {"band_weight": 1.0, "first_stage": "none", "steps": 16, "every": 4, "folds": 0}
    method = create("subnetworks", **settings).fit(recording)
    error = (truth - method.interference(test))[2:]
    assert scores.improvement_ratio(truth, error, 10.0) > 300.0


def test_the_mean_of_the_networks_of_the_folds_in_float64_comes_back_bit_by_bit(recording, tmp_path):
    method = create("bp", hidden=(4,), steps=3, folds=2, refit=False, **LM).fit(recording)
    fitted = method._fitted
    assert {p.dtype for p in fitted.module.parameters()} == {torch.float64}
    inputs = fitted.inputs(recording)
    one, other = (fitted.output(member, inputs, recording.time_s) for member in fitted.module.members)
    assert np.abs(one - other).max() > 1e-3
    both = fitted.output(fitted.module, inputs, recording.time_s)
    np.testing.assert_allclose(both, 0.5 * (one + other), rtol=0, atol=1e-12)
    method.save(tmp_path / "run")
    np.testing.assert_array_equal(load(tmp_path / "run").interference(recording), method.interference(recording))


@pytest.mark.parametrize(
    ("name", "settings", "error", "text"),
    [
        ("bp", {**LM, "tutor": 0.1}, RequestError, "tutor 0.1 has no effect with optimizer 'lm'"),
        ("bp", {**LM, "batch": 5}, RequestError, "batch 5 has no effect with optimizer 'lm'; leave it out, or"),
        ("bp", {**LM, "learning_rate": 0.1}, RequestError, "learning_rate 0.1 has no effect with optimizer 'lm'"),
        ("subnetworks", {"surgery": True}, RequestError, "surgery True has no effect with optimizer 'lm'"),
        ("bp", {**LM, "hidden": (80, 80)}, RequestError, "trains networks of 1 to 5000 parameters; SampleMLP has 7921"),
    ],
)
def test_what_an_optimizer_does_not_take_is_refused(recording, name, settings, error, text):
    with pytest.raises(error, match=text):
        create(name, **settings, steps=2, folds=0).fit(recording)


def test_settings_of_adam_that_a_preset_brings_along_do_not_matter(recording):
    settings = {"optimizer": "lm", "steps": 1, "every": 1, "folds": 0, "hidden": (2,), "inputs": ("tl16",)}
    method = create("bp", preset="paper", **settings).fit(recording.take(slice(0, 900)))
    assert method.settings.batch == 256
    assert method.outcomes_["all"].steps == 1
