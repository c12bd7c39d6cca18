"""Direction cosines of a fluxgate and their derivative by time."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.columns import mean_strength, pick_fluxgate
from magsim.compensation.columns.direction import direction_cosines, time_derivative
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.signals import spans
from tests.support.worlds import VECTOR, calibration


@pytest.mark.parametrize(("method", "relative"), [("central", 0.024), ("spline", 2e-4)])
def test_derivative_is_per_second(method, relative):
    """At 0.6 Hz and 10 Hz sampling central differences are sinc(2 f / fs) = 2.3 % low."""
    time_s = np.arange(600) / 10.0
    omega = 2.0 * np.pi * 0.6
    got = time_derivative(np.sin(omega * time_s), time_s, method)[50:-50]
    exact = omega * np.cos(omega * time_s)[50:-50]
    error = np.abs(got - exact).max() / omega
    assert error < relative
    assert method == "spline" or error > 0.02


def test_derivative_stops_at_a_gap():
    time_s = np.concatenate([np.arange(50), np.arange(80, 120), [200.0]]) / 10.0
    values = np.where(time_s < 6.0, 3.0 * time_s, 1000.0 - 2.0 * time_s)
    assert [s.stop - s.start for s in spans(time_s)] == [50, 40, 1]
    for method in ("central", "spline"):
        slope = time_derivative(values, time_s, method)
        np.testing.assert_allclose(slope[:50], 3.0, rtol=1e-9)
        np.testing.assert_allclose(slope[50:90], -2.0, rtol=1e-9)
        assert slope[90] == 0.0


def test_a_piece_too_short_for_a_spline_has_central_differences():
    time_s = np.concatenate([np.arange(10), np.arange(30, 33)]) / 10.0
    values = time_s**2
    slope = time_derivative(values, time_s, "spline")
    np.testing.assert_allclose(slope[:10], 2.0 * time_s[:10], rtol=0, atol=1e-12)
    np.testing.assert_allclose(slope[10:], np.gradient(values[10:], 0.1))


def test_cosines_are_the_reading_over_its_length():
    time_s = np.arange(2.0)
    reading = {"flux_a_x_nt": [3.0, 0.0], "flux_a_y_nt": [4.0, -2.0], "flux_a_z_nt": [12.0, 0.0]}
    recording = Recording("r", time_s, {name: np.array(values) for name, values in reading.items()})
    cosines, length = direction_cosines(recording, "a")
    np.testing.assert_allclose(cosines, [[3 / 13, 4 / 13, 12 / 13], [0.0, -1.0, 0.0]], rtol=1e-15)
    np.testing.assert_allclose(length, [13.0, 2.0], rtol=1e-15)
    # the mean over all rows of all recordings
    assert mean_strength([recording], "a") == 7.5
    assert mean_strength([recording, recording.take(slice(0, 2))], "a") == 7.5


def test_the_first_fluxgate_of_the_first_recording_unless_named():
    r = calibration(VECTOR)
    second = replace(r, data={**{f"flux_aft_{a}_nt": r[f"flux_cabin_{a}_nt"] for a in "xyz"}, **r.data})
    assert pick_fluxgate([second, r][1:]) == "cabin"
    assert pick_fluxgate([second]) == "aft"
    assert pick_fluxgate([second, r], "cabin") == "cabin"
    with pytest.raises(RequestError, match="recording 'world' has no fluxgate 'aft'; it has cabin"):
        pick_fluxgate([second, r])
    bare = replace(r, data={name: v for name, v in r.data.items() if not name.startswith("flux")})
    with pytest.raises(RequestError, match="has no fluxgate ''; it has none"):
        pick_fluxgate([bare])
