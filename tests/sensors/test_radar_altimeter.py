"""The radar altimeter: noise by height, and where it hears nothing."""

import numpy as np
import pytest

from magsim.scenario import Radar
from magsim.sensors.clocks import instants
from magsim.sensors.radar_altimeter import radar_columns
from magsim.terrain import Flat, Ground
from magsim.trajectory import Trajectory

GROUND = Ground(Flat(100.0), 0.0)
ROWS = 20_000


def path(height_m=400.0, roll=0.0, pitch=0.0, rows=ROWS):
    """Over flat ground at 100 m."""
    t = np.arange(rows) / 10.0
    zero, still = 0.0 * t, np.zeros((rows, 3))
    attitude = np.stack([np.radians(roll) + zero, np.radians(pitch) + zero, zero], axis=1)
    return Trajectory(t, 0.8 + zero, 0.1 + zero, 100.0 + height_m + zero, still, attitude, still)


def reading(radar, seed=1, **keys):
    return radar_columns(radar, path(**keys), GROUND, seed)["radar_alt_m"]


@pytest.mark.parametrize(("noise", "relative", "height"), [(0.5, 0.0, 400.0), (0.0, 0.01, 200.0), (0.5, 0.002, 700.0)])
def test_noise_is_white_and_grows_with_height(noise, relative, height):
    error = reading(Radar(noise_m=noise, noise_relative=relative), height_m=height) - height
    assert error.std() == pytest.approx(np.hypot(noise, relative * height), rel=0.02)
    assert abs(error.mean()) < 4.0 * error.std() / np.sqrt(ROWS)
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.03
    other = reading(Radar(noise_m=noise, noise_relative=relative), seed=2, height_m=height) - height
    assert abs(np.corrcoef(error, other)[0, 1]) < 0.03


def test_a_quiet_one_reads_the_height_and_never_less_than_nothing():
    np.testing.assert_allclose(reading(Radar(noise_m=0.0, noise_relative=0.0)), 400.0, rtol=0, atol=1e-9)
    low = reading(Radar(noise_m=1.0), height_m=0.5)
    assert low.min() == 0.0
    assert np.mean(low == 0.0) == pytest.approx(0.31, abs=0.02)  # half a standard deviation


def test_beyond_its_range_and_tilt_there_is_no_echo():
    far = np.where(np.arange(ROWS) < 100, 299.0, 301.0)
    has_echo = reading(Radar(max_range_m=300.0), height_m=far) != -1.0
    np.testing.assert_array_equal(has_echo, far < 300.0)
    assert set(reading(Radar(max_tilt_deg=20.0), roll=19.9)) != {-1.0}
    assert set(reading(Radar(max_tilt_deg=20.0), roll=20.1)) == {-1.0}
    # Tilts of both axes: cos 15 cos 15 is the cosine of 21.1 degrees.
    assert set(reading(Radar(max_tilt_deg=21.0), roll=15.0, pitch=15.0)) == {-1.0}
    assert -1.0 not in reading(Radar(max_tilt_deg=21.2), roll=15.0, pitch=15.0)


def test_its_clock_is_that_of_every_channel():
    """Descending 3 m/s: 0.2 s late is 0.6 m high, 200 ppm after 1000 s as much."""
    rows = np.arange(10_000) / 10.0
    sinking = path(5000.0 - 3.0 * np.arange(11_000) / 10.0, rows=11_000)
    quiet = {"noise_m": 0.0, "noise_relative": 0.0, "max_range_m": 1e4}
    right = radar_columns(Radar(**quiet), sinking.at(rows), GROUND, 1)["radar_alt_m"]
    for keys, late in (({"skew_s": 0.2}, 0.2 + 0.0 * rows), ({"drift_ppm": 200.0}, 2e-4 * rows)):
        radar = Radar(**quiet, **keys)
        taken = instants(radar, rows[10:], "radar", 1, (0.0, 1099.9))
        read = radar_columns(radar, sinking.at(taken), GROUND, 1)["radar_alt_m"]
        np.testing.assert_allclose(read - right[10:], 3.0 * late[10:], rtol=0, atol=1e-6)
