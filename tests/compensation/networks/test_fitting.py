"""Networks on a Tolles-Lawson residual: what they must reach, what they learn from, and how they stop."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from magsim import signals
from magsim.compensation import FitContext, create
from magsim.compensation.networks import descent, fitted
from magsim.compensation.networks.fitting import enough_steps, pooled
from magsim.compensation.networks.windows import apply_network
from magsim.errors import DataError, RequestError
from magsim.training import Outcome
from tests.support import scores
from tests.support.worlds import EXACT, World, calibration, parts

PAPER = World(eddy_tau_s=0.01)
"""Fixed dipoles, induced, eddies of 10 ms, fluxgate beside the sensor, white noise."""


@pytest.fixture(scope="module")
def recording():
    return calibration(PAPER)


def ratios(name, seed, world=PAPER, **params):
    recording = calibration(world, seed)
    test = recording.where(split="test")
    truth = test["interference_cabin_nt"]
    out = []
    for method in (create("tl16"), create(name, preset="quick", **params)):
        method.fit(recording, context=FitContext(seed))
        out.append(scores.improvement_ratio(truth, truth - method.interference(test), 10.0))
    return out


def test_magtcn_on_the_residual_beats_tolles_lawson():
    """A few of the steps of the preset give more than 2."""
    first, second = ratios("magtcn", 0, steps=100, folds=2, every=25)
    assert second > 1.3 * first


def test_bp_on_the_residual_beats_tolles_lawson():
    first, second = ratios("bp", 0, steps=500, folds=2)
    assert second > 1.3 * first


def test_where_nothing_is_left_to_learn_the_estimate_is_that_of_the_stage():
    recording = calibration(replace(EXACT, eddy_s=((0.0,) * 3,) * 3))
    stage = create("tl16").fit(recording)
    method = create("bp", **ADAM, steps=40, every=10, batch=2).fit(recording)
    difference = method.interference(recording) - stage.interference(recording)
    assert np.abs(difference).max() < 1e-4


def test_a_network_runs_on_the_threads_of_its_settings_all_through_a_fit(recording, monkeypatch):
    """Other threads give other last bits, and those of several processes wait for each other."""
    found = []

    def counted(*args, **kwargs):
        found.append(torch.get_num_threads())
        return apply_network(*args, **kwargs)

    monkeypatch.setattr(fitted, "apply_network", counted)
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        create("bp", **ADAM, steps=2, every=1, batch=2, folds=2, threads=1).fit(recording).interference(recording)
    finally:
        torch.set_num_threads(before)
    assert len(found) > 4
    assert set(found) == {1}


def test_steps_of_the_second_run():
    history = ((0, float("nan"), 5.0), (10, 1.0, 2.0), (20, 1.0, 2.1), (30, 1.0, 3.0))
    assert enough_steps(Outcome(10, 2.0, 30, history)) == 20
    assert enough_steps(Outcome(0, 5.0, 30, ((0, float("nan"), 5.0), (10, 1.0, 5.1)))) == 0


def test_folds_count_together_step_by_step():
    """One that has stopped keeps its last value: mean squares of (3, 4), (1, 4) and (1, 2)."""
    nan = float("nan")
    first = Outcome(1, 1.0, 1, ((0, nan, 3.0), (1, 1.0, 1.0)))
    second = Outcome(2, 2.0, 2, ((0, nan, 4.0), (1, 1.0, 4.0), (2, 1.0, 2.0)))
    both = pooled([first, second])
    assert [value**2 for _, _, value in both.history] == pytest.approx([12.5, 8.5, 2.5])
    assert (both.best_step, both.steps) == (2, 2)


ADAM = {"optimizer": "adam", "weight_decay": 0.0, "refit": True}
QUICK = {**ADAM, "steps": 6, "every": 3, "batch": 4, "hold_out": "split", "shrink": False, "patience": 5}


def test_folds_judge_and_the_last_run_learns_from_all(recording):
    two = create("bp", **QUICK).fit(recording)
    assert set(two.outcomes_) == {"fold 1", "all"}
    one = create("bp", **QUICK | {"refit": False}).fit(recording)
    assert set(one.outcomes_) == {"fold 1"}
    assert one.outcomes_["fold 1"] == pytest.approx(two.outcomes_["fold 1"], nan_ok=True)
    alone = create("bp", **QUICK).fit(recording.where(split="train"))
    assert set(alone.outcomes_) == {"all"}
    several = create("bp", **QUICK | {"hold_out": "blocks", "folds": 3}).fit(recording)
    assert set(several.outcomes_) == {"fold 1", "fold 2", "fold 3", "all"}
    assert set(create("bp", **QUICK | {"folds": 0}).fit(recording).outcomes_) == {"all"}


def test_a_network_without_evidence_is_not_used(recording):
    """The label of a day whose interference is Tolles-Lawson's, and steps of noise on it that inputs cannot tell."""
    noise = np.cumsum(np.random.default_rng(1).standard_normal(len(recording)))
    noise = signals.band_pass(noise, 10.0)
    label = recording["interference_cabin_nt"] + noise
    noisy = replace(recording, data={**recording.data, "interference_cabin_nt": label})
    method = create("bp", **ADAM, steps=60, every=20, batch=4, learning_rate=0.01).fit(noisy)
    assert method._fitted.weight < 0.2
    stage = method._fitted.stage.interference(recording)
    difference = signals.band_pass(method.interference(recording) - stage, 10.0)[300:-300]
    assert difference.std() < 0.1 * noise.std()


def test_stage_and_windows_run_through_the_border_of_training_and_validation_rows(recording, monkeypatch):
    """Rows that touch are one piece of 640 s, not pieces of 480 s and 160 s whose borders are cropped."""
    lengths = []

    class Spy(descent.ArrayWindows):
        def __init__(self, pieces, *, rows):
            lengths.append([len(piece) for piece in pieces])
            super().__init__(pieces, rows=rows)

    monkeypatch.setattr(descent, "ArrayWindows", Spy)
    stage = create("bp", **QUICK).fit(recording)._fitted.stage
    assert set(map(tuple, lengths)) == {(6400,)}
    learned = recording.take(slice(0, 6400))
    whole = replace(learned, data={name: values for name, values in learned.data.items() if name != "split"})
    np.testing.assert_array_equal(stage.coefficients_, create("tl16").fit(whole).coefficients_)
    apart = create("tl16").fit([recording.where(split="train"), recording.where(split="valid")])
    assert np.abs(stage.coefficients_ - apart.coefficients_).max() > 1e-6


def test_the_first_value_is_the_error_of_the_stage_on_the_rows_that_judge(recording):
    """By hand: the stage learns from all rows; its error is filtered, then the rows are taken."""
    method = create("bp", **QUICK | {"refit": False}).fit(recording)
    learned = recording.take(slice(0, 6400))
    without_split = replace(learned, data={n: v for n, v in learned.data.items() if n != "split"})
    stage = create("tl16").fit(without_split)
    error = learned["interference_cabin_nt"] - stage.interference(learned)
    judging = learned["split"] == 1.0
    judging[:300] = judging[-300:] = False
    expected = np.std(signals.band_pass(error, 10.0)[judging])
    (step, _, value), *_ = method.outcomes_["fold 1"].history
    assert step == 0
    assert value == pytest.approx(expected, rel=1e-9)


def test_papers_own_loss_runs(recording):
    params = {"width": 2, "kernel": 11, "steps": 6, "every": 3, "batch": 2, "tutor": 0.05, "surgery": True}
    method = create("magtcn", first_stage="none", hold_out="split", **params)
    method.fit([r.where(split="train") for r in (recording, calibration(PAPER, 1))])
    assert all(np.isfinite(value) for _, _, value in method.outcomes_["all"].history)


def test_a_training_that_was_broken_off_ends_as_one_without_a_break(recording, tmp_path):
    def make():
        return create(
            "magtcn", width=2, kernel=11, steps=15, every=5, batch=2, learning_rate=0.003, folds=2, hold_out="blocks"
        )

    class Broken(Exception):
        pass

    def breaks(progress):
        if progress.phase == "fold 1" and progress.step == 10:
            raise Broken

    whole = make().fit(recording)
    with pytest.raises(Broken):
        make().fit(recording, context=FitContext(progress=breaks, checkpoint=tmp_path))
    seen = []
    resumed = make().fit(recording, context=FitContext(progress=seen.append, checkpoint=tmp_path))
    assert [progress.step for progress in seen[:2]] == [10, 15]
    assert repr(resumed.outcomes_) == repr(whole.outcomes_)
    for name, tensor in whole._fitted.module.state_dict().items():
        assert (tensor == resumed._fitted.module.state_dict()[name]).all()
    np.testing.assert_array_equal(resumed.interference(recording), whole.interference(recording))
    with pytest.raises(RequestError, match="other settings or other recordings"):
        make().fit(recording, context=FitContext(seed=1, checkpoint=tmp_path))


def test_the_seed_decides_start_weights_and_batches(recording):
    params = QUICK | {"first_stage": "none", "learning_rate": 1e-3, "refit": False}
    same, again, other = (create("bp", **params).fit(recording, context=FitContext(seed)) for seed in (5, 5, 6))
    np.testing.assert_array_equal(same.interference(recording), again.interference(recording))
    assert np.abs(same.interference(recording) - other.interference(recording)).max() > 1e-6


def test_what_cannot_be_trained_is_refused(recording):
    train, valid, test = parts(recording)
    with pytest.raises(DataError, match="a window has 9000 rows, but the longest piece without a gap has 6400"):
        create("bp", **ADAM, window=9000, hold_out="split").fit(recording)
    with pytest.raises(RequestError, match="too short for the in-band loss"):
        create("bp", **ADAM, window=100).fit(recording)
    with pytest.raises(RequestError, match="folds 1: one fold of blocks leaves all of them out and nothing to learn"):
        create("bp", folds=1).fit(recording)
    with pytest.raises(DataError, match="no row to stop training by"):
        create("bp", **ADAM, hold_out="split", steps=2).fit([train, valid.take(slice(0, 400))])
    with pytest.raises(DataError, match=r"recording 'world' has 5 rows a second; the network learned from 10"):
        create("bp").fit([train, valid.take(slice(None, None, 2))])
    method = create("bp", **ADAM, hold_out="split", steps=2, every=1).fit(train)
    with pytest.raises(DataError, match="has 5 rows a second; the network learned from 10"):
        method.interference(test.take(slice(None, None, 2)))


def test_without_torch_the_rest_works_and_networks_name_what_they_need():
    program = """
import sys
class NoTorch:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "torch":
            raise ImportError("No module named 'torch'")
sys.meta_path.insert(0, NoTorch())
import magsim.benchmark
from magsim.compensation import create, names
from magsim.errors import RequestError
assert "magtcn" in names()
create("tl16")
try:
    create("magtcn")
except RequestError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "pip install 'aeromagsim[train]'" in done.stdout
