"""Pieces of a time axis."""

import numpy as np
import pytest

from magsim import signals

RATE = 10.0


def test_a_time_axis_is_split_where_it_jumps():
    time_s = np.r_[np.arange(50), np.arange(80, 120), 200] / 10.0
    found = signals.spans(time_s)
    assert [(span.start, span.stop) for span in found] == [(0, 50), (50, 90), (90, 91)]
    assert signals.spans(time_s[:50]) == [slice(0, 50)]
    assert signals.spans(np.array([3.0, 9.0])) == [slice(0, 2)]


@pytest.mark.parametrize(("step", "pieces"), [(1.49, 1), (1.51, 2)])
def test_one_and_a_half_usual_steps_are_no_jump(step, pieces):
    time_s = np.cumsum([0.0, *[1.0] * 5, step, *[1.0] * 5])
    assert len(signals.spans(time_s)) == pieces


def test_ends_are_cropped_by_time():
    t = np.arange(0.0, 100.0, 0.1) + 5.0
    kept = t[signals.off_ends(t)]
    assert kept[0] == pytest.approx(35.0)
    assert kept[-1] == pytest.approx(t[-1] - signals.EDGE_S)
    assert signals.off_ends(t, 0.0).all()
    assert not signals.off_ends(t, 60.0).any()


@pytest.fixture
def holed():
    """Pieces of 100 s, 50 s and 80 s."""
    time_s = np.r_[np.arange(1000), np.arange(1500, 2000), np.arange(3000, 3800)] / RATE
    return time_s, np.random.default_rng(0).normal(size=(len(time_s), 2))


def test_pieces_are_filtered_separately_and_cropped(holed):
    time_s, values = holed
    rate_hz = 1.0 / np.median(np.diff(time_s))
    expected = [signals.band_pass(values[piece], rate_hz)[300:-300] for piece in (slice(0, 1000), slice(1500, None))]
    np.testing.assert_array_equal(signals.in_band(values, time_s), np.concatenate(expected))
    np.testing.assert_array_equal(signals.in_band(values[:, 0], time_s), np.concatenate(expected)[:, 0])


def test_rows_that_are_not_wanted_are_filtered_along(holed):
    time_s, values = holed
    wanted = np.random.default_rng(1).random(len(time_s)) < 0.5
    rate_hz = 1.0 / np.median(np.diff(time_s))
    expected = [
        signals.band_pass(values[piece], rate_hz)[300:-300][wanted[piece][300:-300]]
        for piece in (slice(0, 1000), slice(1500, None))
    ]
    np.testing.assert_array_equal(signals.in_band(values, time_s, wanted), np.concatenate(expected))


def test_too_short_pieces_give_no_rows(holed):
    time_s, values = holed
    assert signals.in_band(values[1000:1500], time_s[1000:1500]).shape == (0, 2)
    assert signals.in_band(values, time_s, np.zeros(len(time_s), dtype=bool)).shape == (0, 2)


@pytest.mark.parametrize("rows", [2, 3, 4, 5, 100, 101])
def test_the_median_step_is_that_of_numpy(rows: int) -> None:
    time_s = np.cumsum(np.random.default_rng(rows).uniform(0.05, 0.15, rows))
    assert signals.median_step(time_s) == np.median(np.diff(time_s))
