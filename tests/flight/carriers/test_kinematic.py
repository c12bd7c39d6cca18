"""The carrier without a flight model: airspeed, crab, turns, sway, attitude, and what it refuses."""

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import welch

from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.earth.gravity import gravity_n
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.carriers.sway import sway
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.loading import load_scenario
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario, ground_of
from magsim.trajectory import Flight, Trajectory
from magsim.units import G0

SPEED_MPS, HEIGHT_M = 28.0, 1250.0
WIND = {"wind_north_mps": 5.0, "wind_east_mps": -8.0}
STILL = {"sway": {"lateral_m": 0.0, "vertical_m": 0.0}}
BOX = {"kind": "box", "leg_m": 600.0, "bank_deg": 12.0}
LINE = {"kind": "straight", "leg_m": 600.0}
PLACES = {
    "middle": (48.7, 127.2, 0.0),
    "date line": (10.0, 179.995, 90.0),
    "far north": (85.0, -30.0, 45.0),
    "at the north pole": (89.9, 10.0, 0.0),
    "at the south pole": (-89.95, 179.99, 200.0),
}
"""Latitude, longitude, first course."""


@pytest.fixture(scope="module")
def helicopter() -> Aircraft:
    return load_aircraft("helicopter")


@pytest.fixture(scope="module")
def bird() -> Bird:
    return load_bird("bird")


ScenarioOf = Callable[..., Scenario]


@pytest.fixture(scope="module")
def scenario_of(helicopter: Aircraft, bird: Bird) -> ScenarioOf:
    """Make a scenario of a pattern and a place; other tables by keyword."""

    def make(pattern: dict, place: str = "middle", **tables: object) -> Scenario:
        lat, lon, course = PLACES[place]
        start = {"lat_deg": lat, "lon_deg": lon, "heading_deg": course, "alt_m": HEIGHT_M, "speed_mps": SPEED_MPS}
        raw = {
            "schema": 1,
            "seed": 1,
            "aircraft": "helicopter",
            "start": start | tables.pop("start", {}),
            "pattern": pattern,
            "flight": STILL,
            "sensors": {"scalar": [{"name": "cabin", "mount": "cabin"}]},
        }
        return FlyableScenario.model_validate(raw | tables, context={"aircraft": helicopter, "bird": bird})

    return make


def places(path: Trajectory) -> np.ndarray:
    return ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)


def through_air(flight: Flight) -> np.ndarray:
    """Velocity through the air, north, east, down."""
    return flight.carrier.velocity_n - flight.wind_n


def angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return (first - second + math.pi) % (2.0 * math.pi) - math.pi


@pytest.fixture(scope="module", params=list(PLACES))
def box(request: pytest.FixtureRequest, scenario_of: ScenarioOf, helicopter: Aircraft) -> Flight:
    """A circuit in wind, without sway."""
    return fly(scenario_of(BOX, request.param, air=WIND), helicopter)


def test_the_airspeed_is_held_through_the_wind(box: Flight) -> None:
    np.testing.assert_allclose(np.linalg.norm(through_air(box), axis=1), SPEED_MPS, rtol=0, atol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(box.wind_n, axis=1), math.hypot(5.0, 8.0), rtol=1e-6)
    assert not box.wind_n[:, 2].any()
    # The wind is felt: over ground it is faster on some legs than on others.
    assert np.ptp(np.linalg.norm(box.carrier.velocity_n, axis=1)) > 10.0


def test_it_heads_where_it_moves_through_the_air(box: Flight) -> None:
    north, east, _ = through_air(box).T
    assert np.abs(angle(np.arctan2(east, north), box.carrier.attitude[:, 2])).max() < 1e-6
    course = np.arctan2(box.carrier.velocity_n[:, 1], box.carrier.velocity_n[:, 0])
    crab = np.degrees(np.abs(angle(course, box.carrier.attitude[:, 2])))
    # The largest crab is that of the whole wind from the side.
    assert 15.0 < crab.max() < math.degrees(math.asin(math.hypot(5.0, 8.0) / SPEED_MPS)) + 1e-6


def test_the_pattern_is_met(box: Flight) -> None:
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
    scenario_of: ScenarioOf, helicopter: Aircraft, flight: dict, limit_deg: float
) -> None:
    """The force of the rotor points along its mast: what is left of the motion without weight and drag.

    The acceleration has a corner at each point of the path, where differences miss it; the density of the standard
    atmosphere at 1250 m is 1.0846 kg/m^3.
    """
    flight = fly(scenario_of(BOX, air=WIND, flight=flight), helicopter)
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
def test_turns_have_the_planned_bank(scenario_of: ScenarioOf, helicopter: Aircraft, turn: str, sign: float) -> None:
    flight = fly(scenario_of(BOX | {"turn": turn, "bank_deg": 20.0}), helicopter)
    radius = SPEED_MPS**2 / (G0 * math.tan(math.radians(20.0)))
    for segment in (s for s in flight.segments if s.turn):
        at = flight.carrier.at(np.array([0.5 * (segment.start_s + segment.stop_s)]))
        assert math.degrees(at.attitude[0, 0]) == pytest.approx(sign * 20.0, abs=0.05)
        # It turns with V / R about the vertical.
        turning = at.rate_b[0, 1] * math.sin(at.attitude[0, 0]) + at.rate_b[0, 2] * math.cos(at.attitude[0, 0])
        assert turning == pytest.approx(sign * SPEED_MPS / radius, rel=1e-3)
        # V / R over the eased ends makes them longer than a quarter of a circle by the ease of 4 s.
        assert segment.length_m == pytest.approx(0.5 * math.pi * radius + 4.0 * SPEED_MPS, abs=0.1)
    with_wind = fly(scenario_of(BOX | {"turn": turn, "bank_deg": 20.0}, air=WIND), helicopter)
    assert np.degrees(np.abs(with_wind.carrier.attitude[:, 0])).max() < 20.05


# ---- sway ------------------------------------------------------------------------------------------------------


def test_sway_has_its_spread_and_its_band() -> None:
    """Eleven hours: 0.23 Hz of noise have 18 000 degrees of freedom, a spread of 0.5 % for the standard deviation."""
    low, high = 0.02, 0.25
    time = np.arange(0.0, 40_000.0, 0.5)
    moved = sway(time, (0.5, 2.0), (low, high), 7)
    np.testing.assert_allclose(moved.std(axis=0), [0.5, 2.0], rtol=0.025)
    assert np.abs(moved.mean(axis=0)).max() < 0.01
    assert abs(np.corrcoef(moved.T)[0, 1]) < 0.04
    frequency, power = welch(moved[:, 0], 2.0, nperseg=4096)
    inside = (frequency > 0.5 * low) & (frequency < 2.0 * high)
    assert power[~inside].sum() < 0.01 * power.sum()

    def near(hertz: float) -> float:
        return power[np.abs(frequency / hertz - 1.0) < 0.12].mean()

    # Forward and backward, the edges of the band keep a quarter of the power of the middle.
    for edge in (low, high):
        assert near(edge) == pytest.approx(0.25 * near(0.07), rel=0.25)


def test_a_flight_sways_as_it_is_asked(scenario_of: ScenarioOf, helicopter: Aircraft) -> None:
    """Over 12 minutes and three seeds, across the line and in height."""
    spreads = []
    for seed in (1, 2, 3):
        asked = {"sway": {"lateral_m": 1.5, "vertical_m": 0.25}}
        flight = fly(scenario_of(LINE | {"leg_m": 20_000.0}, seed=seed, flight=asked), helicopter)
        rows = (flight.carrier.time_s > 0.0) & (flight.carrier.time_s < flight.duration_s)
        path = places(flight.carrier)[rows]
        ahead = (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0])
        right = np.cross(-path[0] / np.linalg.norm(path[0]), ahead)
        spreads.append((np.std(path @ right), np.std(flight.carrier.alt_m[rows])))
        assert (flight.notes["sway_lateral_m"], flight.notes["sway_vertical_m"]) == (1.5, 0.25)
    lateral, vertical = np.sqrt(np.mean(np.square(spreads), axis=0))
    assert lateral == pytest.approx(1.5, rel=0.15)
    assert vertical == pytest.approx(0.25, rel=0.15)


def test_sway_moves_across_the_line_and_leaves_the_airspeed_along_it(
    scenario_of: ScenarioOf, helicopter: Aircraft
) -> None:
    """Along a line to the north the ground speed is that of the wind triangle, whatever the sway."""
    flight = fly(scenario_of(LINE | {"leg_m": 3000.0}, air=WIND, flight={}), helicopter)
    along = math.sqrt(SPEED_MPS**2 - 8.0**2) + 5.0
    np.testing.assert_allclose(flight.carrier.velocity_n[:, 0], along, rtol=0, atol=1e-4)
    # Beside it there is what the place says: the sway's own velocity.
    east, up = flight.carrier.velocity_n[:, 1], -flight.carrier.velocity_n[:, 2]
    path = places(flight.carrier)
    inner, to_n = slice(1, -1), rot_ne_at(flight.carrier.lat_rad, flight.carrier.lon_rad)
    moved = np.einsum("nij,nj->ni", to_n[inner], (path[2:] - path[:-2]) * flight.carrier.rate_hz / 2.0)
    assert np.abs(moved[:, 1] - east[inner]).max() < 2e-3
    assert 0.1 < np.std(east) < 1.0
    assert 0.1 < np.std(up) < 1.0
    off = np.abs(np.linalg.norm(through_air(flight), axis=1) - SPEED_MPS)
    assert 0.01 < off.max() < np.hypot(east, up).max()


def test_sway_is_the_same_whatever_rate_and_length(scenario_of: ScenarioOf, helicopter: Aircraft) -> None:
    tables = [
        {"flight": {}},
        {"flight": {"log_hz": 60}},
        {"flight": {"step_hz": 240, "log_hz": 20}},
    ]
    flights = [fly(scenario_of(LINE, **table), helicopter) for table in tables]
    flights.append(fly(scenario_of(LINE | {"leg_m": 2000.0}, flight={}), helicopter))
    common = np.arange(-3.0, 20.0, 0.5)
    first, *others = (places(flight.carrier.at(common)) for flight in flights)
    for other in others:
        np.testing.assert_allclose(other, first, rtol=0, atol=1e-4)
    moved = places(fly(scenario_of(LINE, flight={}, seed=2), helicopter).carrier.at(common))
    assert np.abs(moved - first).max() > 0.2


# ---- heights ---------------------------------------------------------------------------------------------------


def rise(flight: Flight) -> np.ndarray:
    """Vertical acceleration by differences of the velocity, up [m/s^2]."""
    return -np.gradient(flight.carrier.velocity_n[:, 2], flight.carrier.time_s)[3:-3]


def test_a_part_of_a_sequence_has_its_height(scenario_of: ScenarioOf, helicopter: Aircraft) -> None:
    parts = [LINE, LINE | {"north_m": 5000.0, "alt_m": 1400.0}]
    flight = fly(scenario_of({"kind": "sequence", "parts": parts}), helicopter)
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


def test_a_drape_follows_the_ground_gently(scenario_of: ScenarioOf, helicopter: Aircraft) -> None:
    hills = {"kind": "fractal", "mean_m": 400.0, "relief_m": 300.0, "geoid_m": 48.0}
    drape = {"kind": "survey", "lines": 2, "line_m": 3000.0, "spacing_m": 300.0, "drape_m": 100.0, "climb_slope": 0.1}
    scenario = scenario_of(drape, terrain=hills, start={"alt_m": 700.0}, recording={"valid_legs": []})
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


# ---- with a bird -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", list(PLACES))
def test_a_bird_trails_behind_wherever_it_is_towed(
    scenario_of: ScenarioOf, helicopter: Aircraft, bird: Bird, place: str
) -> None:
    """The place of the bird from Earth-fixed places; the Earth's turning pulls it aside by 2 w V sin(lat)."""
    flight = fly(
        scenario_of(LINE, place, tow={"settle_s": 30.0, "gusts": {"speed_mps": 0.0}}, air=WIND), helicopter, bird=bird
    )
    time = np.arange(0.0, flight.duration_s, 0.5)
    above, below = flight.carrier.at(time), flight.bird.at(time)
    hang = np.einsum("nij,nj->ni", rot_ne_at(above.lat_rad, above.lon_rad), places(below) - places(above))
    air_n = above.velocity_n - flight.wind_at(time)
    forward = air_n[:, :2] / SPEED_MPS
    ahead = np.einsum("ni,ni->n", hang[:, :2], forward)
    right = hang[:, 1] * forward[:, 0] - hang[:, 0] * forward[:, 1]
    # The hook is 1.1 m under the carrier's center of gravity; the rope has 30 m.
    np.testing.assert_allclose(np.linalg.norm(hang - [0.0, 0.0, 1.1], axis=1), 30.2, rtol=0, atol=0.15)
    trail = np.degrees(np.arctan2(-ahead, hang[:, 2] - 1.1))
    assert np.abs(trail - 9.0).max() < 0.2
    ground_mps = math.hypot(*above.velocity_n[0, :2])
    aside = 2.0 * 7.292115e-5 * ground_mps * math.sin(above.lat_rad[0]) / 9.81
    # The lift of the bird, some percent of its weight, lets it hang the farther aside.
    np.testing.assert_allclose(right / hang[:, 2], aside, rtol=0.25, atol=2e-4)
    assert flight.bird.alt_m.max() < HEIGHT_M - 29.0
    assert np.abs(np.diff(flight.bird.lon_rad)).max() < math.radians(0.2)


def test_a_bird_swings_the_same_however_densely_its_carrier_is_logged(
    scenario_of: ScenarioOf, helicopter: Aircraft, bird: Bird
) -> None:
    """The hook lies 1.1 m under a body that rolls with the sway: what it does must not be an effect of the log."""
    tow = {"settle_s": 20.0, "gusts": {"speed_mps": 0.0}}
    flights = [
        fly(scenario_of(LINE, flight={"log_hz": rate}, tow=tow), helicopter, bird=bird) for rate in (30, 20, 60, 120)
    ]
    time = np.arange(0.0, 20.0, 0.1)
    first, *others = flights
    assert np.ptp(np.degrees(first.rope_at(time)["side_rad"])) > 3.0
    for other in others:
        assert np.abs(places(other.bird.at(time)) - places(first.bird.at(time))).max() < 0.03
        assert np.degrees(np.abs(other.bird.at(time).attitude - first.bird.at(time).attitude)).max() < 0.1
    # Roll over the sway of 0.5 m below 0.25 Hz: some times (2 pi 0.25)^2 0.5 / g, and its second derivative on 1.1 m.
    rolling = np.diff(first.carrier.rate_b[:, 0]) * first.carrier.rate_hz
    assert 1.1 * np.std(rolling) < 1.5


# ---- what it refuses -------------------------------------------------------------------------------------------

TEXT = """\
schema = 1
seed = 1
aircraft = "helicopter"

[start]
lat_deg = 48.7
lon_deg = 127.2
alt_m = 1250.0
speed_mps = 28.0

[pattern]
kind = "straight"
leg_m = 1000.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin"

"""
KINEMATIC = "helicopter is kinematic"


def told(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(folder)
    Path("s.toml").write_text(text)
    with pytest.raises(RequestError) as caught:
        load_scenario("s.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            '[[pattern.maneuvers]]\naxis = "roll"\namplitude_deg = 5.0\n',
            (
                f"s.toml:21: pattern.maneuvers[0].amplitude_deg: {KINEMATIC} and swings by its own sway alone; "
                "allowed: no maneuvers"
            ),
        ),
        (
            "[air]\nturbulence_severity = 2\n",
            (
                f"s.toml:20: air.turbulence_severity: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, "
                "flight.sway and tow.gusts"
            ),
        ),
        (
            "[[air.gusts]]\nat_s = 5.0\nduration_s = 3.0\nnorth_mps = 2.0\n",
            (
                f"s.toml:19: air.gusts: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, flight.sway and "
                "tow.gusts"
            ),
        ),
        (
            "[air.random_gusts]\nevery_s = 5.0\nspeed_mps = 2.0\n",
            (
                f"s.toml:19: air.random_gusts: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, "
                "flight.sway and tow.gusts"
            ),
        ),
        (
            "[loading]\npayload_kg = 100.0\n",
            "s.toml:19: loading: no load changes the motion of a kinematic carrier; allowed: no table [loading]",
        ),
        (
            "[loading]\nburn_fuel = true\n",
            "s.toml:19: loading: Light helicopter, kinematic burns no fuel; allowed: burn_fuel = false",
        ),
        (
            "[[flight.flaps]]\ndeflection_deg = 10.0\nat_s = 3.0\n",
            "s.toml:20: flight.flaps[0].deflection_deg: helicopter has no flaps; allowed: none",
        ),
        (
            '[tow]\ncoupling = "two_way"\n',
            "s.toml:20: tow.coupling: a carrier without a flight model feels no rope; allowed: 'one_way'",
        ),
    ],
)
def test_what_needs_a_flight_model_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, more: str, message: str
) -> None:
    assert told(TEXT + more, tmp_path, monkeypatch) == message


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        (
            "speed_mps = 28.0",
            "speed_mps = 3.0",
            "s.toml:9: start.speed_mps: helicopter cannot hold 3 m/s; allowed: 8 to 60",
        ),
        (
            "speed_mps = 28.0",
            "speed_mps = 28.0\nflap_deg = 5.0",
            "s.toml:10: start.flap_deg: helicopter has no flaps; allowed: 0",
        ),
        (
            '"straight"',
            '"fom"',
            f"s.toml:11: pattern: {KINEMATIC} and swings by its own sway alone; allowed: no maneuvers",
        ),
        (
            "leg_m = 1000.0",
            "leg_m = 1000.0\nbank_deg = 40.0",
            "s.toml:14: pattern.bank_deg: 40 deg is more bank than helicopter turns with; allowed: 5 to 30",
        ),
        (
            '"helicopter"',
            '"helicoper"',
            (
                "s.toml:3: aircraft: there is no aircraft 'helicoper'; allowed: c208b, helicopter, uav, or a folder of "
                "your own by its path with a slash, such as ./mine (did you mean 'helicopter'?)"
            ),
        ),
    ],
)
def test_what_it_cannot_fly_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, instead: str, message: str
) -> None:
    assert told(TEXT.replace(line, instead), tmp_path, monkeypatch) == message


def test_a_flight_model_does_not_sway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = TEXT.replace('"helicopter"', '"c208b"').replace("28.0", "60.0").replace('"cabin"\n\n', '"cabin_center"\n\n')
    message = "s.toml:20: flight.sway: c208b is flown by a flight model; allowed: for a kinematic carrier alone"
    assert told(text + "[flight]\nsway = { lateral_m = 1.0 }\n", tmp_path, monkeypatch) == message


def test_the_ground_is_not_flown_into(scenario_of: ScenarioOf, helicopter: Aircraft, bird: Bird) -> None:
    """The carrier by its own height; the bird by the rope's length."""
    low = {"start": {"alt_m": 20.0}}
    fly(scenario_of(LINE, **low), helicopter)
    with pytest.raises(DataError, match=r"^the bird touched the ground at t = -4.0 s, -11 m above the ellipsoid"):
        fly(scenario_of(LINE, **low, tow={"settle_s": 10.0}), helicopter, bird=bird)
    rising = {"flight": {"sway": {"lateral_m": 0.0, "vertical_m": 20.0}}, "start": {"alt_m": 5.0}}
    with pytest.raises(DataError, match=r"^the carrier touched the ground at t = -?\d+\.\d s, -?\d+ m above the "):
        fly(scenario_of(LINE, **rising), helicopter)
