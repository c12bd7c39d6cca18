"""Networks on a Tolles-Lawson residual: what they must reach, what they learn from, and how they stop."""

import statistics
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from magsim import signals
from magsim.compensation import FitContext, create
from magsim.compensation.networks import residual
from magsim.compensation.networks.residual import enough_steps
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
    """The goal is 0.9 times; a few of the steps of the demo preset give about 2."""
    gains = [second / first for first, second in (ratios("magtcn", seed, steps=70) for seed in range(3))]
    assert min(gains) > 0.9
    assert statistics.median(gains) > 1.5


def test_bp_on_the_residual_beats_tolles_lawson():
    first, second = ratios("bp", 0, steps=500)
    assert second > 1.5 * first


def test_where_nothing_is_left_to_learn_the_estimate_is_that_of_the_stage():
    recording = calibration(replace(EXACT, eddy_s=((0.0,) * 3,) * 3))
    stage = create("tl16").fit(recording)
    method = create("bp", steps=40, every=10, batch=2).fit(recording)
    difference = method.interference(recording) - stage.interference(recording)
    assert np.abs(difference).max() < 1e-4


def test_steps_of_the_second_run():
    history = ((0, float("nan"), 5.0), (10, 1.0, 2.0), (20, 1.0, 2.1), (30, 1.0, 3.0))
    assert enough_steps(Outcome(10, 2.0, 30, history)) == 20
    assert enough_steps(Outcome(0, 5.0, 30, ((0, float("nan"), 5.0), (10, 1.0, 5.1)))) == 0


QUICK = {"steps": 6, "every": 3, "batch": 4, "hold_out": "legs"}


def test_held_out_legs_stop_the_training_and_are_learned_in_the_second_run(recording):
    two = create("bp", **QUICK).fit(recording)
    assert set(two.outcomes_) == {"select", "refit"}
    one = create("bp", refit=False, **QUICK).fit(recording)
    assert set(one.outcomes_) == {"select"}
    assert one.outcomes_["select"] == pytest.approx(two.outcomes_["select"], nan_ok=True)
    alone = create("bp", **QUICK).fit(recording.where(split="train"))
    assert set(alone.outcomes_) == {"refit"}


def test_stage_and_windows_run_through_the_border_of_training_and_validation_rows(recording, monkeypatch):
    """Rows that touch are one piece of 640 s, not pieces of 480 s and 160 s whose borders are cropped."""
    lengths = []

    class Spy(residual.ArrayWindows):
        def __init__(self, pieces, *, rows):
            lengths.append([len(piece) for piece in pieces])
            super().__init__(pieces, rows=rows)

    monkeypatch.setattr(residual, "ArrayWindows", Spy)
    stage = create("bp", **QUICK).fit(recording)._fitted.stage
    # inputs and targets of the first run, which learns from the training rows, and of the second
    assert lengths == [[4800]] * 2 + [[6400]] * 2
    learned = recording.take(slice(0, 6400))
    whole = replace(learned, data={name: values for name, values in learned.data.items() if name != "split"})
    np.testing.assert_array_equal(stage.coefficients_, create("tl16").fit(whole).coefficients_)
    apart = create("tl16").fit([recording.where(split="train"), recording.where(split="valid")])
    assert np.abs(stage.coefficients_ - apart.coefficients_).max() > 1e-6


@pytest.mark.parametrize("hold_out", ["legs", "blocks"])
def test_the_first_value_is_the_error_of_the_stage_on_the_rows_that_judge(recording, hold_out):
    """By hand: the stage learns from the other rows; its error over all rows is filtered, then the rows are taken."""
    method = create("bp", **QUICK | {"hold_out": hold_out}, refit=False).fit(recording)
    learned = recording.take(slice(0, 6400))
    if hold_out == "legs":
        judging = learned["split"] == 1.0
        rows = ~judging
    else:
        # 32 s of each 128 s from 48 s on, and 6 s on each side that nobody uses
        into = learned.time_s - 48.0
        judging = (into >= 0.0) & (into % 128.0 < 32.0)
        rows = ~((into >= -6.0) & ((into + 6.0) % 128.0 < 44.0))
    without_split = replace(learned, data={n: v for n, v in learned.data.items() if n != "split"})
    stage = create("tl16").fit(without_split.take(rows))
    error = learned["interference_cabin_nt"] - stage.interference(learned)
    inside = np.zeros(6400, dtype=bool)
    inside[300:-300] = True
    expected = np.std(signals.band_pass(error, 10.0)[judging & inside])
    (step, _, value), *_ = method.outcomes_["select"].history
    assert step == 0
    assert value == pytest.approx(expected, rel=1e-9)


def test_papers_own_loss_runs(recording):
    params = {"width": 2, "kernel": 11, "steps": 6, "every": 3, "batch": 2, "tutor": 0.05, "surgery": True}
    method = create("magtcn", first_stage="none", hold_out="legs", **params)
    method.fit([r.where(split="train") for r in (recording, calibration(PAPER, 1))])
    assert all(np.isfinite(value) for _, _, value in method.outcomes_["refit"].history)


def test_a_training_that_was_broken_off_ends_as_one_without_a_break(recording, tmp_path):
    def make():
        return create("magtcn", width=2, kernel=11, steps=15, every=5, batch=2, learning_rate=0.003)

    class Broken(Exception):
        pass

    def breaks(progress):
        if progress.phase == "select" and progress.step == 10:
            raise Broken

    whole = make().fit(recording)
    with pytest.raises(Broken):
        make().fit(recording, context=FitContext(progress=breaks, checkpoint=tmp_path))
    seen = []
    resumed = make().fit(recording, context=FitContext(progress=seen.append, checkpoint=tmp_path))
    assert seen[0].step == 15
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
    with pytest.raises(DataError, match="a window has 9000 rows, but the longest piece without a gap has 4800"):
        create("bp", window=9000, hold_out="legs").fit(recording)
    with pytest.raises(RequestError, match="too short for the in-band loss"):
        create("bp", window=100).fit(recording)
    with pytest.raises(DataError, match="no row to stop training by"):
        create("bp", hold_out="legs", steps=2).fit([train, valid.take(slice(0, 400))])
    with pytest.raises(DataError, match=r"recording 'world' has 5 rows a second; the network learned from 10"):
        create("bp").fit([train, valid.take(slice(None, None, 2))])
    method = create("bp", hold_out="legs", steps=2, every=1).fit(train)
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
