"""A carrier without a flight model: airspeed, crab, turns, attitude, heights."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.earth import rot_ne_at
from magsim.earth.gravity import gravity_n
from magsim.flight import fly
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.scenario import Scenario, ground_of
from magsim.trajectory import Flight
from magsim.units import G0
from tests.support.helicopters import BOX, HEIGHT_M, LINE, PLACES, SPEED_MPS, STILL, WIND, angle, places, through_air

ScenarioOf = Callable[..., Scenario]


@pytest.fixture(scope="module", params=list(PLACES))
def box(request: pytest.FixtureRequest, helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> Flight:
    """A circuit in wind, without sway."""
    return fly(helicopter_scenario(BOX, request.param, air=WIND), helicopter)


def test_the_airspeed_is_held_through_the_wind(box: Flight) -> None:
    np.testing.assert_allclose(np.linalg.norm(through_air(box), axis=1), SPEED_MPS, rtol=0, atol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(box.wind_n, axis=1), math.hypot(5.0, 8.0), rtol=1e-6)
    assert not box.wind_n[:, 2].any()
    # The wind acts: over ground it is faster on some legs than on others.
    assert np.ptp(np.linalg.norm(box.carrier.velocity_n, axis=1)) > 10.0


def test_it_heads_where_it_moves_through_the_air(box: Flight) -> None:
    north, east, _ = through_air(box).T
    assert np.abs(angle(np.arctan2(east, north), box.carrier.attitude[:, 2])).max() < 1e-6
    course = np.arctan2(box.carrier.velocity_n[:, 1], box.carrier.velocity_n[:, 0])
    crab = np.degrees(np.abs(angle(course, box.carrier.attitude[:, 2])))
    # The largest crab is that of the whole wind from the side.
    assert 15.0 < crab.max() < math.degrees(math.asin(math.hypot(5.0, 8.0) / SPEED_MPS)) + 1e-6


def test_the_pattern_is_flown(box: Flight) -> None:
    assert [segment.turn for segment in box.segments] == [False, True] * 4
    assert box.segments[0].start_s == 0.0
    for before, after in pairwise(box.segments):
        assert before.stop_s == after.start_s
    assert 0.0 <= box.segments[-1].stop_s - box.duration_s < 0.1
    for leg in (segment for segment in box.segments if not segment.turn):
        first, middle, last = places(box.carrier.at(np.linspace(leg.start_s, leg.stop_s, 3)))
        assert np.linalg.norm(last - first) == pytest.approx(600.0, abs=1e-3)
        assert leg.length_m == pytest.approx(600.0, abs=0.01)
        ahead = (last - first) / np.linalg.norm(last - first)
        aside = (middle - first) - ahead * ((middle - first) @ ahead)
        # Straight but for the Earth's curvature, s^2 / (8 R) downwards: 7 mm.
        assert np.linalg.norm(aside) < 0.01
    first, last = places(box.carrier.at(np.array([0.0, box.segments[-1].stop_s])))
    assert np.linalg.norm(last - first) < 1e-3
    assert box.notes["closure_m"][0] < 1e-3
    np.testing.assert_allclose(box.carrier.alt_m, HEIGHT_M, rtol=0, atol=1e-6)


def test_the_path_is_as_long_as_its_segments(box: Flight) -> None:
    """Chords between rows of Earth-fixed places, which know neither date line nor pole."""
    path = places(box.carrier.at(np.linspace(0.0, box.segments[-1].stop_s, 20_000)))
    chords = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert sum(segment.length_m for segment in box.segments) == pytest.approx(chords, abs=0.02)


def test_velocity_and_rates_are_derivatives(box: Flight) -> None:
    carrier, inner = box.carrier, slice(2, -2)
    step = 1.0 / carrier.rate_hz

    def slope(values: np.ndarray) -> np.ndarray:
        """Central differences of fourth order."""
        return (8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) / (12.0 * step)

    to_n = rot_ne_at(carrier.lat_rad[inner], carrier.lon_rad[inner])
    velocity = np.einsum("nij,nj->ni", to_n, slope(places(carrier)))
    assert np.abs(velocity - carrier.velocity_n[inner]).max() < 2e-5
    rot = rot_nb_from_attitude(carrier.attitude)
    spin = np.einsum("nji,njk->nik", rot[inner], slope(rot))
    rate = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    # Where a turn is eased the third derivative of the course jumps.
    assert np.degrees(np.abs(rate - carrier.rate_b[inner])).max() < 0.02


@pytest.mark.parametrize(("flight", "limit_deg"), [(STILL, 0.003), ({}, 0.06), ({"log_hz": 120}, 0.03)])
def test_the_rotor_holds_weight_drag_and_acceleration(
    helicopter_scenario: ScenarioOf, helicopter: Aircraft, flight: dict, limit_deg: float
) -> None:
    """The force of the rotor points along its mast: what is left of the motion without weight and drag.

    The acceleration has a corner at each point of the path, where differences miss it; the density of the standard
    atmosphere at 1250 m is 1.0846 kg/m^3.
    """
    flight = fly(helicopter_scenario(BOX, air=WIND, flight=flight), helicopter)
    carrier, inner = flight.carrier, slice(1, -1)
    rot_ne = rot_ne_at(carrier.lat_rad, carrier.lon_rad)
    velocity_e = rotate_back(rot_ne, carrier.velocity_n)
    rising = np.einsum("nij,nj->ni", rot_ne[inner], (velocity_e[2:] - velocity_e[:-2]) * carrier.rate_hz / 2.0)
    weight = gravity_n(carrier.lat_rad[inner], carrier.alt_m[inner])
    heading = carrier.attitude[inner, 2]
    forward = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(heading))])
    drag = -0.5 * 1.0846 * SPEED_MPS**2 * 1.2 / 2200.0 * forward
    needed = rising - weight - drag
    in_body = rotate_back(rot_nb_from_attitude(carrier.attitude[inner]), needed)
    off = np.degrees(np.arctan2(np.hypot(in_body[:, 0], in_body[:, 1]), -in_body[:, 2]))
    assert off.max() < limit_deg
    assert np.ptp(np.degrees(carrier.attitude[:, 0])) > 10.0


@pytest.mark.parametrize(("turn", "sign"), [("right", 1.0), ("left", -1.0)])
def test_turns_have_the_planned_bank(
    helicopter_scenario: ScenarioOf, helicopter: Aircraft, turn: str, sign: float
) -> None:
    flight = fly(helicopter_scenario(BOX | {"turn": turn, "bank_deg": 20.0}), helicopter)
    radius = SPEED_MPS**2 / (G0 * math.tan(math.radians(20.0)))
    for segment in (s for s in flight.segments if s.turn):
        at = flight.carrier.at(np.array([0.5 * (segment.start_s + segment.stop_s)]))
        assert math.degrees(at.attitude[0, 0]) == pytest.approx(sign * 20.0, abs=0.05)
        # It turns with V / R about the vertical.
        turning = at.rate_b[0, 1] * math.sin(at.attitude[0, 0]) + at.rate_b[0, 2] * math.cos(at.attitude[0, 0])
        assert turning == pytest.approx(sign * SPEED_MPS / radius, rel=1e-3)
        # V / R over the eased ends makes them longer than a quarter of a circle by the ease of 4 s.
        assert segment.length_m == pytest.approx(0.5 * math.pi * radius + 4.0 * SPEED_MPS, abs=0.1)
    with_wind = fly(helicopter_scenario(BOX | {"turn": turn, "bank_deg": 20.0}, air=WIND), helicopter)
    assert np.degrees(np.abs(with_wind.carrier.attitude[:, 0])).max() < 20.05


def rise(flight: Flight) -> np.ndarray:
    """Vertical acceleration by differences of the velocity, up [m/s^2]."""
    return -np.gradient(flight.carrier.velocity_n[:, 2], flight.carrier.time_s)[3:-3]


def test_a_part_of_a_sequence_has_its_height(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    parts = [LINE, LINE | {"north_m": 5000.0, "alt_m": 1400.0}]
    flight = fly(helicopter_scenario({"kind": "sequence", "parts": parts}), helicopter)
    low, transit, high = flight.segments
    assert (low.transit, transit.transit, high.transit) == (False, True, False)
    for leg, height in ((low, HEIGHT_M), (high, 1400.0)):
        at = flight.carrier.at(np.linspace(leg.start_s, leg.stop_s, 50))
        np.testing.assert_allclose(at.alt_m, height, rtol=0, atol=0.05)
        assert leg.length_m == pytest.approx(600.0, abs=0.1)
    climb = -flight.carrier.velocity_n[:, 2]
    assert climb.max() == pytest.approx(3.0, abs=0.01)  # facts.toml
    assert climb.min() > -1e-3
    # 0.1 g rounds the climb; between the points of the plan there are no corners.
    assert np.abs(rise(flight)).max() < 0.1 * G0
    pitch = np.degrees(flight.carrier.attitude[:, 1])
    assert np.ptp(pitch) < 0.2
    # The airspeed is that of the level motion.
    np.testing.assert_allclose(np.hypot(*through_air(flight)[:, :2].T), SPEED_MPS, rtol=0, atol=2e-3)


def test_a_drape_follows_the_ground_gently(helicopter_scenario: ScenarioOf, helicopter: Aircraft) -> None:
    hills = {"kind": "fractal", "mean_m": 400.0, "relief_m": 300.0, "geoid_m": 48.0}
    drape = {"kind": "survey", "lines": 2, "line_m": 3000.0, "spacing_m": 300.0, "drape_m": 100.0, "climb_slope": 0.1}
    scenario = helicopter_scenario(drape, terrain=hills, start={"alt_m": 700.0}, recording={"valid_legs": []})
    flight = fly(scenario, helicopter)
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    carrier = flight.carrier
    lines = [s for s in flight.segments if not s.turn]
    for line in lines:
        at = carrier.at(np.linspace(line.start_s, line.stop_s, 400))
        above = at.alt_m - ground.height(at.lat_rad, at.lon_rad)
        assert above.min() > 99.9
        assert np.ptp(at.alt_m) > 20.0
    assert np.abs(carrier.velocity_n[:, 2]).max() < 0.1 * SPEED_MPS + 0.01
    assert np.abs(rise(flight)).max() < 0.1 * G0
    assert np.abs(np.degrees(carrier.attitude[:, 1])).max() < 3.0
