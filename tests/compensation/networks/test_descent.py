"""The optimizers of networks: what they are given, and what they refuse."""

import numpy as np
import pytest
import torch

from magsim.compensation import create, load
from magsim.compensation.networks import descent
from magsim.compensation.networks.losses import band_matrix
from magsim.errors import DataError, RequestError
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
    for windows, targets, _, operator in given:
        assert windows.dtype == torch.float64
        np.testing.assert_array_equal(windows[1000].numpy(), inputs[1000:1003].T)
        np.testing.assert_array_equal(targets[:, 0].numpy(), rest[2:])
        assert operator is None
    # rows near a border of the folds are learned by neither; no row is learned by both
    both = torch.stack([weights for _, _, weights, _ in given]).sum(dim=0)
    assert set(both.tolist()) == {0.0, 1.0}
    assert (both == 1.0).float().mean() > 0.4


def test_runs_of_errors_are_learned_in_band_too(recording):
    lesson = descent.Lesson([recording], [], [recording["interference_cabin_nt"]], [], [])
    settings = create("bp", **LM | {"band_weight": 2.0}).settings
    operator = descent._band_operator(settings, lesson)
    error = torch.linspace(-1.0, 2.0, 320, dtype=torch.float64) ** 3
    found = (operator @ error).numpy()
    np.testing.assert_allclose(found[:320], error.numpy(), rtol=0, atol=1e-15)
    expected = np.sqrt(lesson.band_weight(2.0)) * band_matrix(320, 10.0) @ error.numpy()
    np.testing.assert_allclose(found[320:], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


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
        ("magtcn", {"optimizer": "lm"}, RequestError, "'lm' takes networks that give one row from the rows before it"),
        ("bp", {"weight_decay": 0.1}, RequestError, "weight_decay 0.1 has no effect with optimizer 'adam'"),
        ("bp", {**LM, "tutor": 0.1}, RequestError, "tutor 0.1 has no effect with optimizer 'lm'"),
        ("bp", {**LM, "hidden": (80, 80)}, RequestError, "trains networks of 1 to 5000 parameters; SampleMLP has 7921"),
    ],
)
def test_what_an_optimizer_does_not_take_is_refused(recording, name, settings, error, text):
    with pytest.raises(error, match=text):
        create(name, **settings, steps=2, folds=0).fit(recording)


def test_pieces_that_are_too_short_are_refused(recording):
    settings = create("bp", **LM | {"band_weight": 1.0}).settings
    short, rows = recording.take(slice(0, 300)), np.ones(300, dtype=bool)
    lesson = descent.Lesson([short], [np.zeros((300, 2))], [np.zeros(300)], [], [rows])
    with pytest.raises(DataError, match="a window has 320 rows, but the longest piece without a gap has 300"):
        descent._all_rows(settings, lesson)
