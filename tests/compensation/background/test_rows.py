"""Backgrounds and channels row by row are those of a whole recording, over gaps and in pieces of a few rows."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.background import CalibratedField, Channel, FluxgateField, ModelField, Regressors
from magsim.compensation.streaming import Feed
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import spans

START = "2025-03-13T08:00:00+00:00"
FEED = Feed(10.0, start_utc=START)


@pytest.fixture(scope="module")
def recording():
    """Motion, a current that is switched, a deflection; pieces of 400, 3, 1, 2 and many rows."""
    rng = np.random.default_rng(8)
    time_s = np.arange(900) / 10.0
    slow = {f"flux_f_{axis}_nt": 3e4 * np.sin(0.3 * time_s + i) for i, axis in enumerate("xyz")}
    data = {name: values + rng.normal(size=900) for name, values in slow.items()}
    data["cur_pump_a"] = np.where(time_s % 40.0 < 20.0, 0.03, 5.0) + 0.004 * rng.normal(size=900)
    data["surface_rudder_deg"] = 4.0 * np.sin(time_s) + 0.01 * rng.normal(size=900)
    data |= {"ins_roll_deg": 10.0 * np.sin(time_s), "ins_pitch_deg": 3.0 + np.cos(time_s)}
    data |= {"ins_heading_deg": (4.0 * time_s) % 360.0, "ins_lat_deg": 45.0 + 1e-4 * time_s}
    data |= {"ins_lon_deg": -75.0 + 1e-4 * time_s, "ins_alt_m": 300.0 + 5.0 * np.sin(time_s)}
    keep = ~np.isin(np.arange(900), [400, 404, 406, 409])
    return Recording("flight", time_s, data, {"start_utc": START}).take(keep)


def through(rows, recording):
    """What comes of all rows, pushed piece by piece."""
    table, out = recording.stack(rows.columns), []
    for span in spans(recording.time_s):
        came = [rows.push(values) for values in table[span]]
        count = span.stop - span.start
        late = min(rows.lookahead_rows, count)
        assert [found is None for found in came] == [True] * late + [False] * (count - late)
        out += [*came[late:], *rows.finish()]
    return np.array(out)


@pytest.mark.parametrize("rest", [None, 0.02, 2.0])
@pytest.mark.parametrize("name", ["cur_pump_a", "surface_rudder_deg"])
def test_channels_follow_their_zero_to_the_bit(name, rest, recording):
    channel = Channel(name, rest)
    np.testing.assert_array_equal(through(channel.rows(10.0), recording), channel(recording))


@pytest.mark.parametrize("lookahead", [0, 3, 8])
@pytest.mark.parametrize("channels", [(), (Channel("cur_pump_a", 0.02), Channel("surface_rudder_deg"))])
def test_a_calibrated_fluxgate_is_that_of_the_recording(channels, lookahead, recording):
    rng = np.random.default_rng(9)
    matrix = np.vstack([rng.normal(scale=300.0, size=(1, 3)), np.eye(3), rng.normal(scale=0.1, size=(3, 3))])
    matrix[1:4] += rng.normal(scale=0.02, size=(3, 3))
    matrix = np.vstack([matrix, rng.normal(size=(len(channels), 3))])
    field = CalibratedField(Regressors("f", channels, lookahead), matrix, 0.15, 0.01, np.zeros((1, 3)), 1.0)
    rows = field.rows(FEED)
    assert rows.lookahead_rows == field.lookahead_rows == lookahead
    np.testing.assert_allclose(through(rows, recording), field(recording), rtol=0.0, atol=1e-9)


def test_the_model_field_is_that_of_the_recording(recording):
    field = ModelField()
    np.testing.assert_allclose(through(field.rows(FEED), recording), field(recording), rtol=0.0, atol=1e-9)
    with pytest.raises(RequestError, match="the model field needs the date: give the stream start_utc"):
        field.rows(replace(FEED, start_utc=None))


def test_a_fluxgate_as_it_is(recording):
    field = FluxgateField("f")
    np.testing.assert_array_equal(through(field.rows(FEED), recording), field(recording))
    with pytest.raises(DataError, match="fluxgate 'f' has no direction"):
        field.rows(FEED).push(np.zeros(3))
