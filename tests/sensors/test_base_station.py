"""The base station's clock, rate and noise."""

import numpy as np
import pytest

from magsim.scenario import BaseStation
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.base_station import base_columns, measure
from magsim.streams import stream

TIME = np.arange(-480, 120 * 604 + 1) / 120.0


def field(time: np.ndarray) -> np.ndarray:
    """Along the vector (2, 1, 2) / 3, so that the length is known."""
    total = 49_000.0 + 5.0 * np.sin(2.0 * np.pi * time / 100.0)
    return total[:, None] * np.array([2.0, 1.0, 2.0]) / 3.0


def acquisition() -> Acquisition:
    return Acquisition.of(TIME, 600.0, 120.0, 10.0)


@pytest.mark.parametrize("delay", [-1.5, 0.0, 2.0])
def test_readings_are_late_by_the_delay_and_straight_between(delay):
    station = BaseStation(noise_nt_rthz=0.0, rate_hz=0.5, delay_s=delay)
    out = base_columns(station, TIME, field(TIME), acquisition(), 1)
    rows = acquisition().time_s
    instants = np.arange(-4.0, 605.0, 2.0)
    exact = np.interp(rows - delay, instants, 49_000.0 + 5.0 * np.sin(2.0 * np.pi * instants / 100.0))
    np.testing.assert_allclose(out["base_ground_nt"], exact, rtol=0, atol=1e-8)


def test_truth_is_what_the_magnetometers_on_board_would_see_there():
    out = base_columns(BaseStation(delay_s=1.0), TIME, field(TIME), acquisition(), 1)
    rows = acquisition().time_s
    np.testing.assert_allclose(
        out["true_base_ground_nt"], 49_000.0 + 5.0 * np.sin(2.0 * np.pi * rows / 100.0), rtol=0, atol=2e-3
    )


def test_noise_has_its_density_and_a_stream_of_its_own():
    station = BaseStation(noise_nt_rthz=0.2, rate_hz=2.0)
    steady = np.full(len(TIME), 49_000.0)
    _, reading = measure(TIME, steady, station, stream(1, "base/ground/noise"))
    assert len(reading) == 2 * 608 + 1
    assert np.std(reading) == pytest.approx(0.2 * np.sqrt(2.0 / 2.0), rel=0.06)
    one = base_columns(station, TIME, field(TIME), acquisition(), 1)["base_ground_nt"]
    other = base_columns(BaseStation(name="hut", noise_nt_rthz=0.2, rate_hz=2.0), TIME, field(TIME), acquisition(), 1)
    assert np.abs(one - other["base_hut_nt"]).max() > 0.1
    again = base_columns(station, TIME, field(TIME), acquisition(), 1)["base_ground_nt"]
    np.testing.assert_array_equal(one, again)
