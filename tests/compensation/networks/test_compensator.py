"""A network as a compensator: what it needs, its warm-up, its files."""

import json

import numpy as np
import pytest

from magsim.compensation import create, load
from magsim.compensation.saving import SETTINGS
from magsim.errors import DataError, RequestError
from tests.support.worlds import World, calibration

FLUX, ATTITUDE = "flux_{sensor}_{axis}_nt", "ins_{angle}_deg"
QUICK = {"steps": 2, "every": 1, "batch": 2, "hold_out": "blocks", "folds": 2}
ADAM = {"optimizer": "adam", "weight_decay": 0.0}


@pytest.mark.parametrize(
    ("settings", "requires"),
    [
        ({}, (FLUX,)),
        ({"inputs": ("attitude",)}, (ATTITUDE, FLUX)),
        ({"inputs": ("attitude",), "first_stage": "none"}, (ATTITUDE,)),
        ({"inputs": ("tl16", "attitude")}, (FLUX, ATTITUDE)),
    ],
)
def test_inputs_and_first_stage_decide_what_is_required(settings, requires):
    assert create("bp", **settings).requires == requires


def test_the_warmup_is_one_window_where_only_its_last_sample_is_returned():
    recording = calibration(World(circuits=1, rate_hz=5.0))
    method = create("bpnn", window=50, hidden=(3,), **QUICK)
    assert method.warmup_s == pytest.approx(4.9)
    # the rate is known from the fit on
    assert method.fit(recording).warmup_s == pytest.approx(9.8)
    assert np.isnan(method.interference(recording)).sum() == 49
    assert create("bp").warmup_s == 0.0
    assert create("magtcn", head="last", window=50).warmup_s == pytest.approx(4.9)
    assert create("magtcn").warmup_s == 0.0


def test_only_windows_that_end_at_the_output_are_causal():
    assert create("magtcn", head="last").causal
    assert not create("magtcn").causal
    assert create("bp").causal
    assert create("bpnn").causal


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"names": ["u1", "u2"]}, r"input scales of shape \(16,\) for 2 inputs"),
        ({"outcomes": {"select": {"step": 1}}}, ""),
        ({"stage": {}}, ""),
        ({"mean_nt": "x"}, ""),
    ],
)
def test_changed_files_are_refused(tmp_path, change, text):
    recording = calibration(World(circuits=1))
    create("bp", **QUICK, **ADAM).fit(recording).save(tmp_path)
    settings = json.loads((tmp_path / SETTINGS).read_text())
    settings["learned"] |= change
    (tmp_path / SETTINGS).write_text(json.dumps(settings))
    with pytest.raises(DataError, match=f"the saved method cannot be read: .*{text}"):
        load(tmp_path)


def test_results_of_the_training_runs_are_saved(tmp_path):
    recording = calibration(World(circuits=1))
    method = create("bp", **QUICK, **ADAM).fit(recording)
    method.save(tmp_path)
    for name, outcome in load(tmp_path).outcomes_.items():
        kept = method.outcomes_[name]
        assert (outcome.best_step, outcome.best_value, outcome.steps) == (kept.best_step, kept.best_value, kept.steps)
        assert outcome.history == ()


def test_windows_that_leave_rows_between_them_are_refused():
    recording = calibration(World(circuits=1))
    with pytest.raises(
        RequestError, match="stride 80 is more than window 40: rows between windows would have no output"
    ):
        create("magtcn", window=40, stride=80, **QUICK).fit(recording)
    assert (create("magtcn").settings.hop, create("magtcn", window=40).settings.hop) == (80, 10)
    assert create("magtcn", window=3).settings.hop == 1
