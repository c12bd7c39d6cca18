"""Streams: the same as a whole recording, for every method that is causal; order, gaps and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import Compensator, create, load
from magsim.errors import DataError, RequestError
from tests.compensation.test_contract import METHODS, WORLD, learn, recording_for
from tests.support.worlds import calibration

FLUX = ("flux_cabin_x_nt", "flux_cabin_y_nt", "flux_cabin_z_nt")
TOLERANCE_NT = 1e-9


def broken(recording):
    """Rows with gaps, a row that stands alone, a piece of two rows, and a dropout in which the reading is held."""
    rows = recording.where(split="test").take(slice(0, 700))
    keep = np.ones(len(rows), dtype=bool)
    keep[[200, 201, 202, 340, 342, 500, 503]] = False
    valid = np.ones(len(rows))
    valid[250:290] = 0.0
    held = np.where(valid == 1.0, rows["mag_cabin_nt"], rows["mag_cabin_nt"][249])
    return replace(rows, data={**rows.data, "mag_cabin_nt": held, "mag_cabin_valid": valid}).take(keep)


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


@pytest.fixture(scope="module")
def rows(recording):
    return broken(recording)


@pytest.fixture(scope="module")
def tl16(recording):
    return create("tl16").fit(recording)


def streamed(stream, recording, *, shuffled=False):
    """All estimates, (n, 3), pushed one by one as mappings."""
    names = [*recording.data, "time_s"]
    names = names[::-1] if shuffled else names
    out, came = [], []
    for i in range(len(recording)):
        found = stream.push({name: float(recording[name][i]) for name in names})
        came.append(found is not None)
        out += [] if found is None else [found]
    late = stream.lookahead_rows
    assert came == [False] * min(late, len(came)) + [True] * max(len(came) - late, 0)
    return np.array([*out, *stream.finish()])


def check_equal(found, method, recording):
    np.testing.assert_array_equal(found[:, 0], recording.time_s)
    np.testing.assert_allclose(found[:, 1], method.interference(recording), rtol=0.0, atol=TOLERANCE_NT)
    np.testing.assert_allclose(found[:, 2], method.compensate(recording), rtol=0.0, atol=TOLERANCE_NT)


@pytest.mark.parametrize("name", METHODS)
def test_every_causal_method_streams_what_it_gives_for_the_recording(name):
    recording = recording_for(name)
    rows = broken(recording)
    method = learn(create(name.split()[0], **METHODS[name]), recording)
    if not method.causal:
        with pytest.raises(RequestError, match=rf"method {method.name} needs rows that come later without limit"):
            method.stream()
        return
    stream = method.stream(start_utc=recording.meta["start_utc"])
    assert stream.lookahead_rows == method.lookahead_rows
    check_equal(streamed(stream, rows), method, rows)
    # after finish it is as new, at an earlier time
    short = rows.take(slice(0, 60))
    check_equal(streamed(stream, short), method, short)


@pytest.mark.parametrize("terms", [3, 9, 18])
@pytest.mark.parametrize("scale", ["constant", "sample"])
def test_every_set_of_terms_streams(terms, scale, recording, rows):
    method = create("tolles_lawson", terms=terms, scale=scale).fit(recording)
    assert method.stream().lookahead_rows == method.lookahead_rows == (1 if terms == 18 else 0)
    check_equal(streamed(method.stream(), rows), method, rows)


def test_columns_are_taken_by_name_in_any_order(tl16, rows):
    check_equal(streamed(tl16.stream(), rows, shuffled=True), tl16, rows)


def test_values_in_the_order_of_columns_are_the_fast_way(tl16, rows):
    stream = tl16.stream()
    assert stream.columns == ("time_s", *FLUX, "mag_cabin_nt")
    table = np.column_stack([rows[name] for name in stream.columns])
    found = [stream.push_values(row) for row in table]
    check_equal(np.array([*(one for one in found if one is not None), *stream.finish()]), tl16, rows)


def test_a_saved_method_knows_the_rate_of_its_rows(tl16, rows, tmp_path):
    tl16.save(tmp_path / "run")
    back = load(tmp_path / "run")
    assert back.stream().rate_hz == tl16.stream().rate_hz == pytest.approx(10.0)
    check_equal(streamed(back.stream(), rows), tl16, rows)


def test_the_rate_may_be_another_one_than_that_of_the_training(tl16, rows):
    slow = rows.take(slice(0, 200, 2))
    check_equal(streamed(tl16.stream(rate_hz=5.0), slow), tl16, slow)
    stream = tl16.stream()
    with pytest.raises(DataError, match=r"did not come 0\.1 s apart; this one comes 0\.2 s after .*rate_hz is 10"):
        streamed(stream, slow)
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(RequestError, match="rate_hz is"):
            tl16.stream(rate_hz=wrong)


def test_what_is_refused_is_not_taken(tl16, rows):
    """The stream goes on as if the row had not come."""
    stream = tl16.stream()
    good = [{name: float(rows[name][i]) for name in stream.columns} for i in range(40)]
    wrong = [
        ({name: value for name, value in good[9].items() if name != FLUX[1]}, RequestError, f"no column {FLUX[1]};"),
        ({**good[9], FLUX[0]: float("nan")}, DataError, f"{FLUX[0]} is nan in the row of time_s"),
        ({**good[9], FLUX[0]: float("inf")}, DataError, f"{FLUX[0]} is inf"),
        ({**good[9], "time_s": float("nan")}, DataError, "time_s is nan"),
        ({**good[9], FLUX[2]: "west"}, RequestError, f"{FLUX[2]} = 'west'; allowed: a number"),
        ({**good[9], FLUX[2]: None}, DataError, f"{FLUX[2]} is nan"),
        ({**good[9], **dict.fromkeys(FLUX, 0.0)}, DataError, "fluxgate 'cabin' has no direction"),
        (good[8], DataError, "does not come after .*; rows come in the order of time"),
        (good[3], DataError, "does not come after"),
    ]
    out = [stream.push(row) for row in good[:9]]
    for row, kind, match in wrong:
        with pytest.raises(kind, match=match):
            stream.push(row)
    with pytest.raises(RequestError, match=r"the row has 3 values; expected 5: time_s, "):
        stream.push_values(np.zeros(3))
    out += [stream.push(row) for row in good[9:]]
    short = rows.take(slice(0, 40))
    check_equal(np.array([*(one for one in out if one is not None), *stream.finish()]), tl16, short)


def test_a_missing_reading_leaves_the_interference(tl16, rows):
    stream = tl16.stream()
    for i in range(3):
        row = {name: float(rows[name][i]) for name in stream.columns} | {"mag_cabin_nt": float("nan")}
        found = stream.push(row)
    assert np.isfinite(found.interference_nt)
    assert np.isnan(found.compensated_nt)


class Plain(Compensator):
    """A method of one's own that gives ``estimate`` alone: a moving sum over rows before and after, never over gaps."""

    name = "plain"
    requires = ("flux_{sensor}_{axis}_nt",)
    memory_rows = 3
    lookahead_rows = 2

    def __init__(self, *, most_nt: float = 1e9) -> None:
        self.most_nt = most_nt

    def learn(self, training, context):
        self.gain_ = 0.5

    def estimate(self, recording):
        flux = recording[recording.names("input")[0]]
        if np.abs(flux).max() > self.most_nt:
            raise DataError("too much")
        out = np.zeros(len(flux))
        weights = (0.1, 0.2, 0.3, 0.5, 0.7, 0.11)
        cuts = np.flatnonzero(np.diff(recording.time_s) > 0.15) + 1
        for rows in np.split(np.arange(len(flux)), cuts):
            for shift, weight in zip(range(-3, 3), weights, strict=True):
                for row in rows:
                    out[row] += weight * flux[row + shift] if row + shift in rows else 0.01
        return self.gain_ * out


def test_a_method_of_finite_memory_needs_no_more_than_its_estimate(recording, rows):
    method = Plain().fit(recording)
    stream = method.stream()
    assert stream.columns == ("time_s", *FLUX, "mag_cabin_nt")
    check_equal(streamed(stream, rows), method, rows)


def test_a_method_of_finite_memory_goes_on_after_what_it_refuses(recording, rows):
    method = Plain(most_nt=1e5).fit(recording)
    stream = method.stream()
    good = [{name: float(rows[name][i]) for name in stream.columns} for i in range(30)]
    out = [stream.push(row) for row in good[:15]]
    with pytest.raises(DataError, match="too much"):
        stream.push({**good[15], FLUX[0]: 1e6})
    out += [stream.push(row) for row in good[15:]]
    found = np.array([*(one for one in out if one is not None), *stream.finish()])
    check_equal(found, method, rows.take(slice(0, 30)))


class Endless(Plain):
    memory_rows = None


def test_a_method_that_does_not_declare_its_memory_is_not_streamed(recording):
    with pytest.raises(RequestError, match=r"plain does not declare how many rows .* unless it sets memory_rows"):
        Endless().fit(recording).stream()


def test_a_method_that_is_not_fitted_is_not_streamed():
    with pytest.raises(RequestError, match="method tl16 is not fitted yet: call fit first"):
        create("tl16").stream()


def test_causal_follows_from_the_look_ahead():
    assert create("tl16").causal
    assert not create("tl16", derivative="spline").causal
    with pytest.raises(TypeError, match=r"Old\.causal follows from lookahead_rows"):
        type("Old", (Plain,), {"causal": False})
