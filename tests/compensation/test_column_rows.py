"""Column sets row by row against the same sets over whole recordings."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.checking.flight import check_flight
from magsim.compensation.column_rows import rows_of
from magsim.compensation.columns import Joined, TollesLawsonColumns
from magsim.compensation.networks.inputs import fit_inputs
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.streaming import Feed
from magsim.dataset import flights_of, read_training
from magsim.errors import RequestError
from tests.support.methods import without

WORDS = (
    *("tl16", "tl18", "auxiliary", "attitude", "angles", "rates", "coupled", "accelerations", "currents", "voltages"),
    *("surfaces", "position", "travel", "height", "time"),
)


def streamed(rows, recording):
    """Columns of a recording, row by row, and whether each came when its look-ahead says."""
    values = np.column_stack([recording.time_s if name == "time_s" else recording[name] for name in rows.columns])
    found = [rows.push(row) for row in values]
    assert [row is None for row in found] == [i < rows.lookahead_rows for i in range(len(values))]
    return np.array([*(row for row in found if row is not None), *rows.finish()])


@pytest.fixture(scope="module")
def recording():
    """A flight whose heading passes north and whose longitude passes the date line."""
    flight = check_flight()
    lon = (flight["ins_lon_deg"] - flight["ins_lon_deg"][900] + 360.0) % 360.0 - 180.0
    return replace(flight, data={**flight.data, "ins_lon_deg": (lon + 360.0) % 360.0 - 180.0})


@pytest.mark.parametrize("word", WORDS)
def test_rows_are_those_of_the_whole_recording(recording, word):
    made = fit_inputs(NetworkSettings(inputs=(word,), scale="sample"), read_training(flights_of(recording))).joined
    feed = Feed(recording.rate_hz, start_utc=recording.meta["start_utc"])
    rows = rows_of(made, feed)
    assert rows.lookahead_rows == made.lookahead_rows
    piece = recording.take(slice(600, 1200))
    expected = made(piece).matrix
    scale = np.abs(expected).max(axis=0) + 1e-300
    # differences of degrees have lost four digits
    close = 1e-9 if word == "travel" else 1e-12
    for _ in range(2):  # a second piece begins as the first one did
        np.testing.assert_allclose(streamed(rows, piece) / scale, expected / scale, rtol=0, atol=close)
    one = recording.take(slice(700, 702))
    np.testing.assert_allclose(streamed(rows, one) / scale, made(one).matrix / scale, rtol=0, atol=close)


def test_attitude_rates_and_all_at_once_with_the_calibrated_direction():
    bare = without(check_flight(), "ins_rate")
    settings = NetworkSettings(inputs=WORDS, direction="calibrated")
    made = fit_inputs(settings, read_training(flights_of(bare))).joined
    rows = rows_of(made, Feed(bare.rate_hz, start_utc=bare.meta["start_utc"]))
    expected = made(bare.take(slice(0, 1500))).matrix
    scale = np.abs(expected).max(axis=0) + 1e-300
    np.testing.assert_allclose(streamed(rows, bare.take(slice(0, 1500))) / scale, expected / scale, rtol=0, atol=1e-9)


def test_what_has_no_form_row_by_row_has_none(recording):
    spline = TollesLawsonColumns(16, "flux", "spline")
    assert rows_of(spline, Feed(10.0)) is None

    class Own:
        reads, lookahead_rows = (), 0

    assert rows_of(Own(), Feed(10.0)) is None
    assert rows_of(Joined((TollesLawsonColumns(16, "flux"), Own())), Feed(10.0)) is None


def test_the_time_of_day_needs_the_date(recording):
    made = fit_inputs(NetworkSettings(inputs=("time",)), read_training(flights_of(recording)))
    with pytest.raises(RequestError, match="the time of day needs the date: give the stream start_utc"):
        rows_of(made.joined, Feed(10.0))
