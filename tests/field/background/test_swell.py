"""The swell below a flight: each magnetometer at its own place and time, Doppler shift, refusals."""

import math

import numpy as np
import pytest

from magsim.earth import LocalFrame, geodetic_from_ecef
from magsim.errors import DataError
from magsim.field import AircraftResponse, compute_field, load_response
from magsim.field.background.main_field import earth_at_start
from magsim.field.background.swell import draw_waves
from magsim.scenario import Swell
from magsim.streams import stream
from magsim.terrain import Flat, Ground
from magsim.trajectory import Flight, Trajectory
from tests.field.background.test_background import (
    AIRCRAFT,
    INSIDE,
    REFERENCE_B,
    SURFACES,
    at_own_place,
    flight,
    scenario,
)

__all__ = ["flight"]

SEA = Ground(Flat(0.0), 44.0)
ROUGH = {"height_m": 4.0, "period_s": 14.0, "heading_deg": 200.0}


@pytest.fixture(scope="module")
def response() -> AircraftResponse:
    return load_response(AIRCRAFT)


def test_the_swell_at_each_own_place_and_time(flight: Flight, response: AircraftResponse) -> None:
    given = scenario(swell=ROUGH)
    truth = compute_field(given, AIRCRAFT, flight, response, ground=SEA)
    waves = draw_waves(stream(1, "swell/waves"), Swell(**ROUGH))
    strength, time = waves.strength_nt(earth_at_start(given), 4.4), truth.time_s[INSIDE]
    frame = LocalFrame(*np.radians([52.2, 9.8]), 44.0)

    def field_e(place_e: np.ndarray) -> np.ndarray:
        height = geodetic_from_ecef(place_e)[2] - 44.0
        return frame.to_earth(waves.field(strength, frame.place(place_e), height, time))

    for mount in truth.mounts:
        exact = at_own_place(flight, truth, mount, field_e, INSIDE)
        assert np.abs(truth.part("swell", mount)[INSIDE] - exact).max() < 1e-4
        assert 0.01 < np.abs(exact).max() < 1.0
    off = compute_field(scenario(), AIRCRAFT, flight, response, ground=SEA)
    assert set(truth.parts_b) - set(off.parts_b) == {"swell"}
    np.testing.assert_array_equal(truth.parts_b["departure"], off.parts_b["departure"])


@pytest.mark.parametrize("heading_deg", [0.0, 120.0, 180.0])
def test_a_wave_is_met_at_its_doppler_frequency(response: AircraftResponse, heading_deg: float) -> None:
    """Long, narrow swell from ahead, from astern and aslant: |k v cos - omega| over the sea at 70 m/s to the north."""
    time = np.arange(-4 * 30, 124 * 30 + 1) / 30.0
    frame = LocalFrame(*np.radians([52.2, 9.8]), 100.0)
    place = np.column_stack([70.0 * time, np.zeros(len(time)), np.zeros(len(time))])
    lat, lon, alt = geodetic_from_ecef(frame.position(place))
    velocity = np.tile([70.0, 0.0, 0.0], (len(time), 1))
    still = np.zeros((len(time), 3))
    carrier = Trajectory(time, lat, lon, alt, velocity, still, still, REFERENCE_B)
    level = Flight(carrier, 120.0, 120.0, {name: np.zeros(len(time)) for name in SURFACES}, (), ())
    swell = {"period_s": 16.0, "height_m": 3.0, "heading_deg": heading_deg, "peak": 10.0, "spread": 200.0}
    truth = compute_field(scenario(swell=swell), AIRCRAFT, level, response)
    down = truth.part("swell", "cabin_center")[:, 2]
    spectrum = np.abs(np.fft.rfft(down * np.hanning(len(down)))) ** 2
    hertz = np.fft.rfftfreq(len(down), 1.0 / 120.0)
    rate = 2.0 * math.pi / 16.0
    met = abs(rate**2 / 9.80665 * 70.0 * math.cos(math.radians(heading_deg)) - rate) / (2.0 * math.pi)
    assert np.average(hertz, weights=spectrum) == pytest.approx(met, rel=0.12)


def test_land_on_the_way_is_refused(flight: Flight, response: AircraftResponse) -> None:
    with pytest.raises(DataError, match=r"field.swell: at -4.0 s the flight is over land"):
        compute_field(scenario(swell=ROUGH), AIRCRAFT, flight, response, ground=Ground(Flat(80.0), 44.0))
