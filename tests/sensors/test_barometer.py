"""The barometer: what an altimeter shows by its rules, and each error against its formula."""

import numpy as np
import pytest

from magsim.scenario import Barometer
from magsim.sensors.barometer import baro_columns, true_baro_columns
from magsim.terrain import Flat, Ground
from magsim.trajectory import Trajectory
from tests.support.allan import allan, gauss_markov_allan

RATE_HZ = 10.0


def flight(height, stop=60.0):
    t = np.arange(-120, round((stop + 4.0) * 30.0) + 1) / 30.0
    zero = 0.0 * t
    still = np.zeros((len(t), 3))
    return Trajectory(t, 0.3 + zero, 1.0 + zero, height(t), still, still, still)


def read(barometer, height=lambda t: 3000.0 + 0.0 * t, *, seed=1, rows=600, late=0.0, ground=None):
    log = flight(height, rows / RATE_HZ)
    path = log.at(np.arange(rows) / RATE_HZ - late)
    out = baro_columns(barometer, log, path, ground=ground, rate_hz=RATE_HZ, seed=seed)
    true = true_baro_columns(barometer, log.at(np.arange(rows) / RATE_HZ), ground)["true_pressure_pa"]
    return out["baro_alt_m"], out["baro_pa"], true


def quiet(**keys):
    return Barometer(**({"noise_pa_rthz": 0.0} | keys))


@pytest.mark.parametrize(("height_m", "pressure_pa"), [(1000.0, 89_876.3), (2000.0, 79_501.4), (11_000.0, 22_699.9)])
def test_in_the_standard_atmosphere(height_m, pressure_pa):
    """Rows of ICAO Doc 7488; the height is geopotential: a 6356766th of its square less."""
    altitude, pressure, true = read(quiet(), lambda t: height_m + 0.0 * t)
    np.testing.assert_allclose(pressure, pressure_pa, rtol=5e-6)
    np.testing.assert_array_equal(pressure, true)
    np.testing.assert_allclose(altitude, height_m - height_m**2 / (6_356_766.0 + height_m), rtol=0, atol=1e-6)


def test_set_to_the_qnh_it_shows_the_height_above_the_sea():
    """And set to 1013.25 hPa it shows less on a day of high pressure: 1023 hPa are 81 m (8.3 m for each)."""
    ground = Ground(Flat(120.0), 45.0)
    altitude, pressure, true = read(quiet(qnh_pa=102_300.0, setting_pa=102_300.0), ground=ground)
    sea = 3000.0 - 45.0
    np.testing.assert_allclose(altitude, sea - sea**2 / (6_356_766.0 + sea), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(pressure, true)
    wrong, same, _ = read(quiet(qnh_pa=102_300.0), ground=ground)
    np.testing.assert_array_equal(same, pressure)
    assert (altitude - wrong)[0] == pytest.approx(81.0, abs=0.5)
    assert pressure[0] > read(quiet(), ground=ground)[1][0]


def test_a_constant_offset():
    altitude, pressure, true = read(quiet(offset_pa=100.0))
    np.testing.assert_allclose(pressure - true, 100.0, rtol=0, atol=1e-9)
    # At 3 km a hectopascal is 11.2 m: R T / (g p) = 287.05 x 268.65 / (9.80665 x 70 108.5).
    assert (read(quiet())[0] - altitude)[0] == pytest.approx(11.2, abs=0.1)


def test_a_climb_is_seen_late_by_the_lag():
    for lag in (0.2, 1.0):
        late, _, _ = read(quiet(lag_s=lag), lambda t: 1000.0 + 5.0 * t)
        right, _, _ = read(quiet(), lambda t: 1000.0 + 5.0 * t)
        # Settled four seconds before the first row.
        gap = 5.0 * lag * (1.0 - np.exp(-(np.arange(600) / RATE_HZ + 4.0) / lag))
        np.testing.assert_allclose(right - late, gap, rtol=2e-3, atol=1e-3)


def test_a_clock_that_is_late():
    rising = lambda t: 1000.0 + 5.0 * t  # noqa: E731
    late, right = read(quiet(), rising, late=0.3)[0], read(quiet(), rising)[0]
    np.testing.assert_allclose(right - late, 1.5, rtol=1e-3)


def test_readings_are_whole_steps():
    _, pressure, true = read(quiet(step_pa=4.0), lambda t: 1000.0 + 5.0 * t)
    np.testing.assert_allclose(pressure / 4.0, np.round(pressure / 4.0), rtol=0, atol=1e-9)
    assert np.abs(pressure - true).max() <= 2.0 + 1e-9
    assert (pressure - true).std() == pytest.approx(4.0 / np.sqrt(12.0), rel=0.1)


def test_noise_and_drift_by_their_allan_deviation():
    barometer = Barometer(noise_pa_rthz=2.0, drift_pa=20.0, correlation_s=10.0)
    _, pressure, true = read(barometer, rows=60_000)
    error = pressure - true
    for window in (0.1, 1.0, 5.0, 20.0):
        wanted = np.hypot(2.0 / np.sqrt(2.0 * window), gauss_markov_allan(20.0, 10.0, window))
        assert allan(error, RATE_HZ, window) == pytest.approx(wanted, rel=0.12), window  # 300 windows of 20 s: 5 %
    assert not np.array_equal(read(barometer, seed=2)[1], read(barometer, seed=1)[1])
    np.testing.assert_array_equal(read(barometer)[1], read(barometer)[1])
