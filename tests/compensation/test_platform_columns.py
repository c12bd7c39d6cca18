"""Directions and auxiliary channels of the linear methods, in a world whose main field is the model's."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create, load
from magsim.compensation.background import LOOKAHEAD_ROWS, ModelField
from magsim.compensation.background.channels import KINDS
from magsim.compensation.columns import TollesLawsonColumns, tolles_lawson_columns
from magsim.compensation.columns.auxiliary import GROUPS
from magsim.compensation.exact_norm.sources import CHANNELS
from magsim.errors import DataError, RequestError
from tests.support import scores
from tests.support.inertial import CURRENT_NT, SURFACE_NT, flown


def judged(name, recording=None, **params):
    """A method fitted on the training rows, and its improvement ratio on the test rows."""
    recording = flown() if recording is None else recording
    method = create(name, **params).fit(recording)
    test = recording.where(split="test")
    error = test["interference_cabin_nt"] - method.interference(test)
    return method, scores.improvement_ratio(test["interference_cabin_nt"], error, 10.0)


def with_channel(recording, name, values):
    return replace(recording, data={**recording.data, name: values})


def test_what_the_fluxgate_and_the_channels_cost_is_won_back_one_by_one():
    ratios = {
        "raw": judged("tl16")[1],
        "ins": judged("tl16_ins")[1],
        "calibrated": judged("tl16_calibrated")[1],
        "auxiliary": judged("tl16_auxiliary")[1],
    }
    assert ratios["auxiliary"] > 1.3 * ratios["calibrated"]
    assert ratios["calibrated"] > 1.4 * ratios["raw"]
    assert ratios["ins"] > 1.4 * ratios["raw"]


def test_the_coefficients_of_channels_are_their_vectors_in_body_axes():
    """In nT/A and nT/deg; the direction is that of the INS, so the axes are those of the body."""
    method, _ = judged("tl16_auxiliary", direction="ins")
    found = {term.name: term for term in method.coefficients()}
    for i in range(3):
        current, surface = found[f"cur_pump_a u{i + 1}"], found[f"surface_aileron_deg u{i + 1}"]
        assert (current.unit, current.group) == ("nT/A", "current pump")
        assert (surface.unit, surface.group) == ("nT/deg", "surface aileron")
        assert current.value == pytest.approx(CURRENT_NT[i], abs=0.05)
        assert surface.value == pytest.approx(SURFACE_NT[i], abs=0.05)
    assert len(method.coefficients_) == 16 + 6
    assert set(method.shares(flown())) == {"permanent", "induced", "eddy", "current pump", "surface aileron", "offset"}


def test_columns_of_the_model_field_are_those_of_its_direction():
    recording = flown().take(slice(0, 400))
    field = ModelField()(recording)
    length = np.linalg.norm(field, axis=1)
    u = field / length[:, None]
    expected = tolles_lawson_columns(u, np.gradient(u, 0.1, axis=0), length, 16)
    got = TollesLawsonColumns(16, "", field=ModelField())(recording).matrix
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-6)


def test_kinds_and_names_of_channels():
    both = judged("tl16", auxiliary=("currents", "surfaces"))[0]
    named = judged("tl16", auxiliary=["surface_aileron_deg", "cur_pump_a"])[0]
    np.testing.assert_allclose(named.interference(flown()), both.interference(flown()), rtol=0, atol=1e-6)
    alone = judged("tl16", auxiliary=("surfaces",))[0]
    assert [t.name for t in alone.report_.terms[16:]] == [f"surface_aileron_deg u{i}" for i in (1, 2, 3)]
    assert "surface_{surface}_deg" in alone.requires
    assert not any(pattern.startswith("cur") for pattern in alone.requires)


def test_dead_channels_of_a_kind_are_left_out_with_a_note_and_named_ones_are_refused():
    dead = with_channel(flown(), "cur_dead_a", np.full(len(flown()), 3.0))
    method, ratio = judged("tl16_auxiliary", dead)
    assert method.report_.left_out == ("cur_dead_a", "no voltages")
    assert "left out, as they do not change: cur_dead_a, no voltages" in str(method.report_)
    assert ratio == pytest.approx(judged("tl16_auxiliary")[1], rel=1e-9)
    with pytest.raises(RequestError, match="auxiliary 'cur_dead_a' does not change in the training rows"):
        create("tl16", auxiliary=("cur_dead_a",)).fit(dead)
    message = (
        r"auxiliary 'cur_pumpe_a' is no channel of recording .*"
        r"allowed: currents, voltages, surfaces, accelerations, or "
        r".*cur_pump_a"
    )
    with pytest.raises(RequestError, match=message):
        create("tl16", auxiliary=("cur_pumpe_a",)).fit(dead)


def test_channels_that_are_not_needed_cost_little():
    """Twelve currents that do nothing: generalized cross-validation does not pay for them."""
    recording = flown()
    rng = np.random.default_rng(0)
    for number in range(12):
        steps = np.repeat(rng.normal(size=len(recording) // 100 + 1), 100)[: len(recording)]
        recording = with_channel(recording, f"cur_idle{number}_a", 5.0 + steps + 0.01 * rng.normal(size=len(steps)))
    method, ratio = judged("tl16_auxiliary", recording, direction="ins")
    assert len(method.coefficients_) == 16 + 3 * 14
    assert ratio > 0.8 * judged("tl16_auxiliary", direction="ins")[1]


@pytest.mark.parametrize("name", ["tl16_ins", "tl16_calibrated", "tl16_auxiliary"])
def test_fitted_columns_come_back_from_files(name, tmp_path):
    method, _ = judged(name, derivative="spline", scale="sample")
    method.save(tmp_path)
    back = load(tmp_path)
    np.testing.assert_array_equal(back.interference(flown()), method.interference(flown()))
    assert back.report_ == method.report_
    assert back.requires == method.requires


def test_settings_without_effect_are_refused():
    with pytest.raises(RequestError, match="fluxgate 'nose' has no effect with direction 'ins'"):
        create("tl16_ins", fluxgate="nose").fit(flown())
    with pytest.raises(RequestError, match="eddy 'field' has no effect with 8 terms"):
        create("tl8", eddy="field").fit(flown())
    with pytest.raises(RequestError, match="variance has no effect with solver 'ridge'"):
        create("tl16", variance=0.9).fit(flown())
    with pytest.raises(RequestError, match="direction is 'ins' by its name"):
        create("tl16_ins", direction="fluxgate")


def test_inputs_of_a_direction_are_required_by_name():
    bare = replace(flown(), data={k: v for k, v in flown().data.items() if not k.startswith("ins_")})
    with pytest.raises(RequestError, match="no column ins_"):
        create("tl16_ins").fit(bare)
    with pytest.raises(RequestError, match="no column ins_"):
        create("tl16_calibrated").fit(bare)
    short = flown().take(slice(0, 300))
    with pytest.raises(DataError):
        create("tl16_calibrated").fit(short)


def test_the_look_ahead_is_that_of_the_direction():
    ahead = {name: create(name).lookahead_rows for name in ("tl16", "tl16_ins", "tl16_calibrated")}
    assert ahead == {"tl16": 1, "tl16_ins": 1, "tl16_calibrated": LOOKAHEAD_ROWS + 1}
    assert create("tl3", direction="calibrated").lookahead_rows == LOOKAHEAD_ROWS
    assert create("tl16_ins", derivative="spline").lookahead_rows is None
    assert judged("tl16_calibrated")[0].lookahead_rows == LOOKAHEAD_ROWS + 1


def test_every_kind_of_channel_has_its_word_everywhere():
    assert set(GROUPS) == set(KINDS.values()) == set(CHANNELS)
    accelerated = with_channel(flown(), "ins_acc_z_mps2", -9.8 + 0.3 * np.sin(flown().time_s))
    method, _ = judged("tl16_auxiliary", accelerated, auxiliary=("accelerations",))
    assert {term.unit for term in method.coefficients() if term.group == "acceleration z"} == {"nT/(m/s^2)"}
