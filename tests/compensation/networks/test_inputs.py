"""Inputs of networks by their names: what they are, what is left out, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import create, load
from magsim.compensation.background import LOOKAHEAD_ROWS, ModelField, fit_background
from magsim.compensation.checking.flight import check_flight
from magsim.compensation.columns import AttitudeColumns, TollesLawsonColumns
from magsim.compensation.networks.inputs import FREE, fit_inputs, inputs_from, most_lookahead, sure_reads
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.saving import SETTINGS
from magsim.dataset import flights_of, read_training
from magsim.errors import DataError, RequestError
from tests.support.inertial import flown
from tests.support.methods import with_dropouts, without

EVERY = (
    *("tl16", "auxiliary", "attitude", "angles", "rates", "coupled", "accelerations", "currents", "voltages"),
    *("surfaces", "position", "travel", "height", "time"),
)
FLUX, ATTITUDE = "flux_{sensor}_{axis}_nt", "ins_{angle}_deg"


def fitted(recording, *inputs, **settings):
    return fit_inputs(NetworkSettings(inputs=inputs, **settings), read_training(flights_of(recording)))


def changed(recording, **values):
    return replace(recording, data={**recording.data, **values})


def test_inputs_are_the_named_column_sets_side_by_side():
    recording = flown()
    learned = recording.take(slice(0, 6400))
    made = fitted(recording, "attitude", "tl18")
    strength_nt = float(np.linalg.norm(learned.stack([f"flux_nose_{axis}_nt" for axis in "xyz"]), axis=1).mean())
    expected = [AttitudeColumns(), TollesLawsonColumns(18, "nose", strength_nt=strength_nt)]
    np.testing.assert_allclose(
        made(recording).matrix, np.hstack([part(recording).matrix for part in expected]), rtol=1e-12, atol=1e-12
    )
    assert made.reads == (ATTITUDE, FLUX)
    assert fitted(recording, "tl16", "tl18")(recording).matrix.shape[1] == 16 + 18


def test_channels_are_one_column_each_with_their_zero_followed():
    recording = flown()
    made = fitted(recording, "surfaces", "currents", first_stage="none")
    design = made(recording)
    assert design.names == ("surface_aileron_deg", "cur_pump_a")
    assert design.units == ("deg", "A")
    np.testing.assert_array_equal(design.matrix[:, 0], recording["surface_aileron_deg"])
    assert np.abs(design.matrix[:, 1] - recording["cur_pump_a"]).max() < 0.01
    # a zero that is another one after the next start is found again while the load is off
    other = changed(recording, cur_pump_a=recording["cur_pump_a"] + 0.05)
    off = made(other).matrix[:, 1] - made(recording).matrix[:, 1]
    assert abs(off[-1]) < 0.005


def test_products_with_the_direction_are_those_of_the_auxiliary_columns():
    recording = flown()
    design = fitted(recording, "auxiliary", direction="ins")(recording)
    field = ModelField()(recording)
    u = field / np.linalg.norm(field, axis=1)[:, None]
    aileron = recording["surface_aileron_deg"]
    expected = (aileron - aileron[:6400].mean())[:, None] * u
    names = [f"surface_aileron_deg u{i}" for i in (1, 2, 3)]
    np.testing.assert_allclose(design.matrix[:, [design.names.index(n) for n in names]], expected, atol=1e-9)
    assert len(design.names) == 6


@pytest.mark.parametrize("direction", ["ins", "calibrated"])
def test_the_direction_is_that_of_the_background(direction):
    recording = flown()
    learned = recording.take(slice(0, 6400))
    made = fitted(recording, "tl16", direction=direction, scale="sample")
    background = fit_background(direction, [learned], "cabin")
    np.testing.assert_array_equal(
        made(recording).matrix, TollesLawsonColumns(16, "", field=background)(recording).matrix
    )
    ahead = 1 if direction == "ins" else LOOKAHEAD_ROWS + 1
    assert made.lookahead_rows == ahead == most_lookahead(NetworkSettings(inputs=("tl16",), direction=direction))


def test_a_calibration_sees_the_rows_without_a_reading():
    """Its filters run through a dropout, which is none of the fluxgate."""
    recording = with_dropouts(flown(), slice(2000, 2003), slice(4000, 4010))
    made = fitted(recording, "tl16", direction="calibrated")
    background = fit_background("calibrated", [recording.take(slice(0, 6400))], "cabin")
    np.testing.assert_array_equal(made.platform.background.matrix, background.matrix)


def test_rates_are_those_of_the_gyros_or_of_the_attitude():
    recording = check_flight()
    gyros = fitted(recording, "rates", first_stage="none")
    assert gyros.reads == ("ins_rate_{axis}_dps",)
    measured = gyros(recording).matrix
    np.testing.assert_allclose(measured, np.radians(recording.stack([f"ins_rate_{a}_dps" for a in "xyz"])), rtol=1e-12)
    bare = without(recording, "ins_rate_")
    attitude = fitted(bare, "rates", first_stage="none")
    assert attitude.reads == (ATTITUDE,)
    assert (gyros.lookahead_rows, attitude.lookahead_rows) == (0, 1)
    assert most_lookahead(NetworkSettings(inputs=("rates",))) == 1
    assert sure_reads(NetworkSettings(inputs=("rates",))) == ()


def test_place_and_time_are_counted_from_where_the_training_was():
    recording = check_flight()
    made = fitted(recording, "position", "height", "time", first_stage="none")
    design = made(recording)
    assert design.names == ("lat", "lon", "height", "time")
    learned = made(recording.where(split="train")).matrix
    assert np.abs(learned[:, :2].mean(axis=0)).max() < 0.01
    assert design.matrix[0, 3] == 14.0
    assert design.matrix[-1, 3] == pytest.approx(14.0 + recording.time_s[-1] / 3600.0)
    lon = (recording["ins_lon_deg"] + 75.7) % 360.0 - 180.0
    shifted = changed(recording, ins_lon_deg=lon)
    assert np.ptp(lon) > 359.0
    there = fitted(shifted, "position", "travel", first_stage="none")(shifted).matrix
    here = fitted(recording, "position", "travel", first_stage="none")(recording).matrix
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-9)


def test_what_was_found_comes_back_from_its_state():
    recording = check_flight()
    settings = NetworkSettings(inputs=EVERY, direction="calibrated")
    made = fit_inputs(settings, read_training(flights_of(recording)))
    back = inputs_from(settings, made.state())
    np.testing.assert_array_equal(back(recording).matrix, made(recording).matrix)
    assert back(recording).names == made(recording).names
    assert back.left_out == made.left_out
    assert back.count == len(made(recording).names)
    assert set(sure_reads(settings)) < set(made.reads)


def test_dead_channels_are_left_out_with_a_note():
    dead = changed(flown(), cur_dead_a=np.full(len(flown()), 3.0))
    method = create("bp", inputs=("tl16", "currents", "voltages"), steps=2, every=1).fit(dead)
    assert method.report_.left_out == ("cur_dead_a", "no voltages")
    assert method.report_.inputs[16:] == ("cur_pump_a",)
    assert "17 inputs: u1, " in str(method.report_)
    assert "left out, as they do not change: cur_dead_a, no voltages" in str(method.report_)
    assert "cur_{feeder}_a" in method.requires
    assert "cur_{feeder}_a" not in create("bp", inputs=("tl16", "currents")).requires


@pytest.mark.parametrize("inputs", [("currents",), ("voltages", "currents"), ("auxiliary",)])
def test_recordings_without_any_of_the_inputs_are_refused(inputs):
    bare = changed(without(flown(), "cur_", "surface_"), cur_dead_a=np.full(len(flown()), 3.0))
    with pytest.raises(
        RequestError, match=r"no column .*cur_\{feeder\}_a.* changes in the training rows of 'inertial'"
    ):
        create("bp", inputs=inputs).fit(bare)


def test_a_recording_that_lacks_a_channel_is_refused_by_its_name(tmp_path):
    two = changed(flown(), cur_lamp_a=flown()["cur_pump_a"][::-1].copy())
    method = create("bp", inputs=("tl16", "currents", "surfaces"), steps=2, every=1).fit(two)
    with pytest.raises(RequestError, match="recording 'inertial' has no column cur_lamp_a"):
        method.interference(flown())
    with pytest.raises(RequestError, match=r"has no column cur_\{feeder\}_a, which method bp requires"):
        method.interference(without(two, "cur_"))
    method.save(tmp_path)
    back = load(tmp_path)
    np.testing.assert_array_equal(back.interference(two), method.interference(two))
    settings = json.loads((tmp_path / SETTINGS).read_text())
    settings["learned"]["inputs"]["channels"]["currents"].pop()
    (tmp_path / SETTINGS).write_text(json.dumps(settings))
    with pytest.raises(DataError, match="the saved method cannot be read: 18 input columns for 19 names"):
        load(tmp_path)
    assert (back.requires, back.report_, back.lookahead_rows) == (
        method.requires,
        method.report_,
        method.lookahead_rows,
    )


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (
            {"inputs": ("attitude",), "first_stage": "none", "direction": "ins"},
            "direction 'ins' has no effect with inp",
        ),
        ({"inputs": ("attitude",), "first_stage": "exact_norm", "direction": "ins"}, "direction 'ins' has no effect"),
        (
            {"inputs": ("attitude",), "first_stage": "none", "fluxgate": "nose"},
            "fluxgate 'nose' has no effect with inp",
        ),
        ({"inputs": ("tl16",), "direction": "ins", "fluxgate": "nose"}, "fluxgate 'nose' has no effect with direction"),
        ({"inputs": ("tl16",), "fluxgate": "tail"}, "has no fluxgate 'tail'; it has nose"),
    ],
)
def test_settings_without_effect_are_refused(settings, text):
    with pytest.raises(RequestError, match=text):
        create("bp", **settings).fit(flown())


def test_words_that_are_unknown_or_given_twice_are_refused():
    with pytest.raises(RequestError, match="inputs: 'tl16' is given 2 times"):
        create("bp", inputs=("tl16", "attitude", "tl16"))
    with pytest.raises(RequestError, match=r"inputs: \['current'\] is not allowed; allowed: a list .*'currents'"):
        create("bp", inputs=("current",))


def test_a_time_of_day_needs_the_date():
    dateless = replace(flown(), meta={k: v for k, v in flown().meta.items() if k != "start_utc"})
    with pytest.raises(
        RequestError, match="'inertial' does not say when it was flown, and the time of day is an input"
    ):
        create("bp", inputs=("tl16", "time")).fit(dateless)


def test_channels_that_are_not_finite_are_refused():
    method = create("bp", inputs=("tl16", "currents"), steps=2, every=1).fit(flown())
    broken = changed(flown(), cur_pump_a=np.where(flown().time_s == 100.0, np.nan, flown()["cur_pump_a"]))
    with pytest.raises(DataError, match="cur_pump_a is not finite at 100 s"):
        method.interference(broken)


def test_every_free_input_says_what_it_reads():
    for word, one in FREE.items():
        assert sure_reads(NetworkSettings(inputs=(word,))) == one.reads
        assert most_lookahead(NetworkSettings(inputs=(word,))) == one.lookahead_rows
