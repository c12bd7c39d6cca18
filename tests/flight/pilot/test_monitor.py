"""Flights that go wrong are reported with time and state; flights at the edge of the world are not wrong."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.earth import ecef_from_geodetic
from magsim.errors import DataError
from magsim.flight import fly
from magsim.flight.model.channels import COLUMN, TO_SI
from magsim.flight.path.elements import PathLabel, PathPoint, Straight
from magsim.flight.path.plane import LocalPlane
from magsim.flight.pilot.monitor import FlightMonitor
from magsim.scenario import FlightSettings, Scenario
from magsim.sensors.true_motion import true_columns

ScenarioOf = Callable[..., Scenario]
STATE = r"at t = -?\d+\.\d s: height \d+ m, airspeed \d+\.\d m/s, roll -?\d+\.\d, pitch -?\d+\.\d, angle of attack"
SHORT = {"kind": "box", "leg_m": 2500.0, "lead_s": 5.0}


def row(**values: float) -> list[float]:
    """A row of the plant, in its own units, from SI values."""
    out = [0.0] * len(COLUMN)
    for name, value in ({"throttle": 0.5, "airspeed": 75.0} | values).items():
        out[COLUMN[name]] = value / TO_SI[COLUMN[name]]
    return out


@pytest.fixture
def monitor(cessna: Aircraft) -> FlightMonitor:
    settings = FlightSettings(surface_saturation_s=2.0, throttle_saturation_s=5.0, leg_tolerance_m=200.0)
    return FlightMonitor(cessna.facts, settings, 75.0, 0.1)


def first_trouble(monitor: FlightMonitor, rows: Iterator[list[float]]) -> tuple[int, str]:
    """Return the number of the first check that failed, and its message."""
    return next((i, trouble) for i, trouble in enumerate((monitor.controls(r) for r in rows), start=1) if trouble)


@pytest.mark.parametrize(
    ("values", "ticks", "trouble"),
    [
        ({"elevator": -0.436332}, 21, "elevator at its lower stop for more than 2 s"),
        ({"aileron": 0.349066}, 21, "aileron at its upper stop for more than 2 s"),
        ({"rudder": 0.436332}, 21, "rudder at its upper stop for more than 2 s"),
        ({"throttle": 1.0, "airspeed": 70.0}, 51, "throttle at its upper stop for more than 5 s"),
        ({"throttle": 0.0, "airspeed": 80.0}, 51, "throttle at its lower stop for more than 5 s"),
    ],
)
def test_a_control_at_its_stop_for_too_long_is_reported(
    monitor: FlightMonitor, values: dict[str, float], ticks: int, trouble: str
) -> None:
    assert first_trouble(monitor, (row(**values) for _ in range(100))) == (ticks, f"was out of control: {trouble}")


def test_a_control_that_leaves_its_stop_starts_again(monitor: FlightMonitor) -> None:
    for _ in range(5):
        assert not any(monitor.controls(row(rudder=0.436332)) for _ in range(20))
        assert not monitor.controls(row(rudder=0.43))


def test_full_throttle_that_holds_the_airspeed_is_allowed(monitor: FlightMonitor) -> None:
    assert not any(monitor.controls(row(throttle=1.0, airspeed=73.5)) for _ in range(1000))


def test_a_leg_is_missed_by_distance_but_a_turn_is_not(monitor: FlightMonitor) -> None:
    leg = Straight(PathLabel(2, 3, False, 180.0), PathPoint(0.0, 0.0, 0.0, 0.0), 1000.0)
    turn = Straight(PathLabel(2, 3, True, 180.0), PathPoint(0.0, 0.0, 0.0, 0.0), 1000.0)
    assert monitor.line(leg, -199.0) == ""
    assert monitor.line(turn, -900.0) == ""
    assert monitor.line(leg, -250.4) == "missed leg 3 of circuit 2: 250 m to the left of its line, allowed 200 m,"


def test_a_gust_that_blows_the_aircraft_off_its_leg_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    storm = {"gusts": [{"at_s": 2.0, "duration_s": 24.0, "east_mps": 40.0}]}
    pattern = SHORT | {"leg_m": 5000.0}
    with pytest.raises(DataError, match=rf"the flight missed leg 1 of circuit 1: \d+ m to the right .* {STATE}"):
        fly(scenario_of(pattern, air=storm, flight={"leg_tolerance_m": 15.0}), cessna)


def test_too_little_power_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # A downdraft of 4 m/s for a minute costs more power at 85 m/s than the engine has left.
    air = {"gusts": [{"at_s": 1.0, "duration_s": 160.0, "down_mps": 9.0}]}
    request = scenario_of(SHORT | {"leg_m": 8000.0}, start={"speed_mps": 85.0}, air=air)
    with pytest.raises(DataError, match=rf"throttle at its upper stop for more than 30 s {STATE}"):
        fly(request, cessna)


def test_a_small_rudder_at_its_stop_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # In still air the rudder is enough; the gust from the side takes the rest of it.
    trains = [{"axis": "yaw", "amplitude_deg": 7.0, "period_s": 10.0}]
    air = {"gusts": [{"at_s": 8.0, "duration_s": 20.0, "east_mps": 15.0}]}
    pattern = SHORT | {"leg_m": 5000.0, "maneuvers": trains}
    request = scenario_of(pattern, flight={"surface_saturation_s": 0.5}, air=air)
    rudder = cessna.facts.controls.rudder
    weak = rudder.model_copy(update={"travel": rudder.travel.model_copy(update={"value": (-0.12, 0.12)})})
    controls = cessna.facts.controls.model_copy(update={"rudder": weak})
    aircraft = Aircraft(cessna.name, cessna.facts.model_copy(update={"controls": controls}), cessna.magnetics)
    with pytest.raises(DataError, match=r"rudder at its (upper|lower) stop for more than 0.5 s at t = "):
        fly(request, aircraft)


def test_a_wind_that_never_lets_the_flight_arrive_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # Slower than the airspeed at the start, but not where shear and gust come together for the whole flight.
    air = {"gusts": [{"at_s": 1.0, "duration_s": 600.0, "north_mps": -74.0}]}
    with pytest.raises(DataError, match=rf"the flight .* {STATE}"):
        fly(scenario_of(SHORT | {"leg_m": 2000.0}, air=air), cessna)


TRAINS = [{"axis": axis, "amplitude_deg": 8.0, "period_s": 5.0, "cycles": 2} for axis in ("pitch", "roll", "yaw")]


@pytest.mark.parametrize(
    "start",
    [
        {"lat_deg": 89.9, "lon_deg": 30.0, "heading_deg": 90.0},
        {"lat_deg": -89.95, "lon_deg": -100.0, "heading_deg": 200.0},
        {"lat_deg": 10.0, "lon_deg": 179.99, "heading_deg": 45.0},
        {"lat_deg": -60.0, "lon_deg": -179.995, "heading_deg": 300.0},
        {"lat_deg": 0.0, "lon_deg": 0.0, "heading_deg": 359.9},
        {"lat_deg": -33.0, "lon_deg": 18.0, "alt_m": 100.0, "speed_mps": 65.0},
        {"lat_deg": 47.0, "lon_deg": 8.0, "alt_m": 6000.0, "speed_mps": 80.0},
    ],
)
def test_flights_begin_trimmed_and_settled_anywhere(
    cessna: Aircraft, scenario_of: ScenarioOf, start: dict[str, float]
) -> None:
    # The loops are calibrated for each speed and height: one axis of them is enough there.
    trains = TRAINS if len(start) == 3 else TRAINS[1:2]
    leg_m = 5500.0 if len(start) == 3 else 3500.0
    pattern = {"kind": "box", "leg_m": leg_m, "maneuvers": trains, "allow_beyond_crew_g": True}
    request = scenario_of(pattern, start=start)
    flight = fly(request, cessna)
    carrier, place = flight.carrier, request.start
    first = carrier.at(np.array([0.0]))
    here = ecef_from_geodetic(first.lat_rad[0], first.lon_rad[0], place.alt_m)
    origin = ecef_from_geodetic(math.radians(place.lat_deg), math.radians(place.lon_deg), place.alt_m)
    assert np.linalg.norm(here - origin) < 5.0
    course = math.degrees(math.atan2(first.velocity_n[0, 1], first.velocity_n[0, 0]))
    assert (course - place.heading_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.2)
    # Settled: nothing moves in the first seconds, before the first maneuver.
    quiet = (carrier.time_s >= 0.0) & (carrier.time_s < 8.0)
    # Near the poles the local frame itself turns, about the vertical.
    assert np.degrees(np.abs(carrier.rate_b[quiet, :2])).max() < 0.05
    assert np.degrees(np.ptp(carrier.attitude[quiet, :2], axis=0)).max() < 0.1
    assert np.ptp(carrier.alt_m[quiet]) < 0.5
    assert np.abs(carrier.alt_m[quiet] - place.alt_m).max() < 1.0
    speed = np.linalg.norm(carrier.velocity_n[quiet], axis=1)
    assert np.abs(speed - place.speed_mps).max() < 0.1
    # As good as anywhere else.
    assert flight.notes["closure_m"][0] < 10.0
    assert all(abs(leg.length_m - leg_m) < 10.0 for leg in flight.segments if not leg.turn)
    assert all(abs(train.flown_deg - train.asked_deg) < 0.2 for train in flight.maneuvers)
    # Smooth over the date line, wrapped in the columns.
    time = np.arange(0.0, flight.duration_s, 0.1)
    rows = carrier.at(time)
    points = ecef_from_geodetic(rows.lat_rad, rows.lon_rad, rows.alt_m)
    # Ground speed of the rows, an arc of the turning Earth's surface: no row is off its track.
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1) / 0.1
    assert np.abs(steps - np.linalg.norm(rows.velocity_n, axis=1)[:-1]).max() < 0.5
    columns = true_columns(rows)
    assert np.abs(columns["true_lon_deg"]).max() <= 180.0
    assert (columns["true_heading_deg"] >= 0.0).all()
    assert (columns["true_heading_deg"] < 360.0).all()
    if abs(place.lon_deg) > 179.0:
        assert columns["true_lon_deg"].min() < -179.9
        assert columns["true_lon_deg"].max() > 179.9


@pytest.mark.parametrize("lat_deg", [0.0, 55.0, 89.9, -89.99])
def test_the_way_back_from_the_plane_holds_everywhere(lat_deg: float) -> None:
    plane = LocalPlane(math.radians(lat_deg), 3.1, 2000.0)
    for place in ((0.0, 0.0), (5000.0, -8000.0), (-700.0, 12000.0)):
        np.testing.assert_allclose(plane.place(*plane.geodetic(*place)), place, atol=1e-6)


def test_jsbsim_prints_nothing_and_leaves_no_file(
    cessna: Aircraft,
    scenario_of: ScenarioOf,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    flight = {"surface_saturation_s": 3.0, "leg_tolerance_m": 0.01}
    fly(scenario_of(SHORT, air={"turbulence_severity": 2}), cessna)
    with pytest.raises(DataError):
        fly(scenario_of(SHORT, air={"turbulence_severity": 2}, flight=flight), cessna)
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())
