"""Flights over the poles: the path, the attitude, the air, and the field that is computed along them.

Everything is judged in Earth-fixed axes, in which a pole is a place like any other.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft
from magsim.earth import decimal_years, ecef_from_geodetic, rot_ne_at
from magsim.earth.grid import grid_turn
from magsim.earth.igrf import field_of_model, igrf14
from magsim.field import compute_field
from magsim.flight import fly
from magsim.frames import rot_nb_from_attitude
from magsim.loading import LoadedScenario
from magsim.plots.figures import flight as flight_figure
from magsim.scenario import Scenario
from magsim.sensors.true_motion import true_columns
from magsim.simulation import record
from magsim.trajectory import Flight, Trajectory
from magsim.truth import FieldTruth

ScenarioOf = Callable[..., Scenario]
WIND = {"wind_north_mps": 6.0, "wind_east_mps": -8.0}
FINE_S = 1.0 / 120.0


def rot_eb(path: Trajectory) -> np.ndarray:
    return np.einsum("nji,njk->nik", rot_ne_at(path.lat_rad, path.lon_rad), rot_nb_from_attitude(path.attitude))


def places(path: Trajectory) -> np.ndarray:
    return ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)


def from_axis_m(path: Trajectory) -> np.ndarray:
    return np.hypot(*places(path)[:, :2].T)


@pytest.fixture(scope="module", params=[90.0, -90.0])
def crossing(request: pytest.FixtureRequest, cessna: Aircraft, scenario_of: ScenarioOf) -> tuple[Scenario, Flight]:
    """A line over the pole, in wind; the start point, its middle, is the pole itself."""
    pattern = {"kind": "straight", "leg_m": 4000.0, "north_m": -2000.0}
    scenario = scenario_of(pattern, start={"lat_deg": request.param, "lon_deg": 37.0, "heading_deg": 0.0}, air=WIND)
    return scenario, fly(scenario, cessna)


def test_a_line_leads_straight_over_the_pole(crossing: tuple[Scenario, Flight]) -> None:
    scenario, flight = crossing
    carrier = flight.carrier
    assert from_axis_m(carrier).min() < 5.0
    # The plane of the start meridian, 37 degrees east, holds the whole leg: its normal is (-sin, cos, 0).
    lon = math.radians(37.0)
    rows = (carrier.time_s >= 0.0) & (carrier.time_s <= flight.duration_s)
    assert np.abs(places(carrier)[rows] @ [-math.sin(lon), math.cos(lon), 0.0]).max() < 5.0
    # It begins on that meridian at the north pole and on the opposite one at the south pole, where north is back.
    first = math.degrees(carrier.at(np.array([0.0])).lon_rad[0])
    expected = 37.0 if scenario.start.lat_deg > 0.0 else -143.0
    assert (first - expected + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.2)
    assert flight.notes["worst_leg_length_error_m"] < 1.0
    np.testing.assert_allclose(carrier.alt_m, 3000.0, atol=0.5)
    assert grid_turn(math.radians(scenario.start.lat_deg)) == -math.copysign(1.0, scenario.start.lat_deg)


def test_nothing_happens_to_the_aircraft_there(crossing: tuple[Scenario, Flight]) -> None:
    carrier = crossing[1].carrier
    quiet = carrier.at(np.arange(2.0, crossing[1].duration_s - 2.0, FINE_S))
    assert np.degrees(np.ptp(quiet.steady_attitude, axis=0)).max() < 0.01
    # The rotation to Earth-fixed axes changes by no more than the path over the curved Earth turns it.
    spin = np.einsum("nji,njk->nik", rot_eb(quiet)[:-1], rot_eb(quiet)[1:]) / FINE_S
    turning = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=-1)
    assert np.abs(turning).max() < 3e-5
    # Heading and longitude have jumped by half a turn all the same.
    assert np.degrees(np.ptp(quiet.attitude[:, 2])) == pytest.approx(180.0, abs=1.0)


def test_position_and_velocity_belong_together_over_the_pole(crossing: tuple[Scenario, Flight]) -> None:
    carrier = crossing[1].carrier
    near = carrier.time_s[from_axis_m(carrier).argmin()]
    path = carrier.at(np.arange(near - 3.0, near + 3.0, FINE_S))
    velocity_e = np.einsum("nij,ni->nj", rot_ne_at(path.lat_rad, path.lon_rad), path.velocity_n)
    flown = (places(path)[2:] - places(path)[:-2]) / (2.0 * FINE_S)
    assert np.abs(flown - velocity_e[1:-1]).max() < 2e-3
    assert np.isfinite(np.column_stack(list(true_columns(path).values()))).all()
    assert np.degrees(np.abs(path.lat_rad)).max() <= 90.0


def test_the_wind_blows_on_over_the_pole(crossing: tuple[Scenario, Flight]) -> None:
    scenario, flight = crossing
    time = np.arange(0.0, flight.duration_s, 0.1)
    path, wind_n = flight.carrier.at(time), flight.wind_at(time)
    wind_e = np.einsum("nij,ni->nj", rot_ne_at(path.lat_rad, path.lon_rad), wind_n)
    # North and east of the start point, the pole on the meridian of 37 degrees.
    place = math.radians(scenario.start.lat_deg), math.radians(37.0)
    expected = rot_ne_at(*place).T @ [6.0, -8.0, 0.0]
    # A place away from the pole its level is another one.
    assert np.abs(wind_e - expected).max() < 10.0 * 4000.0 / 6.3e6 + 1e-3


def test_turbulence_and_gusts_blow_on_over_the_pole(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    gust = {"at_s": 5.0, "duration_s": 30.0, "north_mps": 4.0, "down_mps": -1.0}
    shear = {"kind": "linear", "north_per_s": 0.01}
    air = WIND | {"turbulence_severity": 3, "gusts": [gust], "shear": shear}
    pattern = {"kind": "straight", "leg_m": 3000.0, "north_m": -1500.0, "east_m": 6.0}
    flight = fly(scenario_of(pattern, start={"lat_deg": 90.0, "lon_deg": -70.0}, air=air), cessna)
    carrier = flight.carrier
    wind_e = np.einsum("nij,ni->nj", rot_ne_at(carrier.lat_rad, carrier.lon_rad), flight.wind_n)
    steps = np.linalg.norm(np.diff(wind_e, axis=0), axis=1)
    near = from_axis_m(carrier)[1:] < 150.0
    assert from_axis_m(carrier).min() < 30.0
    assert 20 < near.sum() < 400
    # Turbulence of 1.85 m/s that is mirrored there would jump by metres per second.
    assert steps[near].max() < 1.5 * steps[~near].max()
    steady = wind_e[near.argmax() :][: int(near.sum())].mean(axis=0)
    assert np.linalg.norm(steady[:2]) > 6.0


@pytest.fixture(scope="module")
def field(crossing: tuple[Scenario, Flight], cessna: Aircraft) -> FieldTruth:
    return compute_field(crossing[0], cessna, crossing[1])


def test_the_field_goes_through_the_pole(
    crossing: tuple[Scenario, Flight], field: FieldTruth, cessna: Aircraft
) -> None:
    scenario, flight = crossing
    path = flight.carrier.at(field.time_s)
    # IGRF's own Earth-fixed field at the sensor's place, turned into body axes in one step.
    to_b = np.swapaxes(rot_eb(path), 1, 2)
    arm = np.array(cessna.mounts[field.mounts[0]]) - flight.carrier.reference_b
    place_e = places(path) + np.einsum("nji,j->ni", to_b, arm)
    exact_e = field_of_model(place_e, decimal_years(scenario.start.time_utc, field.time_s), igrf14())
    exact_b = np.einsum("nij,nj->ni", to_b, exact_e)
    earth = field.parts_b["earth"][:, 0]
    near = from_axis_m(path) < 500.0
    assert np.abs(earth - exact_b)[near].max() < 1e-5
    assert np.abs(earth - exact_b).max() < 1e-5
    # Smooth: the curve through every fourth sample meets those between, in each part and in the sum.
    rows = np.flatnonzero(near)
    # The propeller turns faster than it is sampled, and loads are switched.
    rough = field.part("propeller", field.mounts[0]) + field.part("electronics", field.mounts[0])
    total = (field.total(field.mounts[0]) - rough)[rows]
    for values in (earth[rows], total, np.linalg.norm(total, axis=1)[:, None]):
        time = field.time_s[rows]
        between = CubicSpline(time[::4], values[::4])(time[4:-8])
        assert np.abs(between - values[4:-8]).max() < 0.02


def test_a_recording_of_it_is_whole(crossing: tuple[Scenario, Flight], field: FieldTruth, cessna: Aircraft) -> None:
    scenario, flight = crossing
    recording = record(LoadedScenario("pole", scenario, cessna, ""), flight, {"carrier": field})
    assert np.isfinite(recording.stack(list(recording.data))).all()
    for who in ("ins", "true"):
        assert np.abs(recording[f"{who}_lat_deg"]).max() <= 90.0
        assert np.abs(recording[f"{who}_lon_deg"]).max() <= 180.0
    reading = ecef_from_geodetic(
        *np.radians([recording["ins_lat_deg"], recording["ins_lon_deg"]]), recording["ins_alt_m"]
    )
    true = places(flight.carrier.at(recording.time_s))
    assert np.linalg.norm(reading - true, axis=1).max() < 10.0 * scenario.sensors.ins.position_noise_m + 1e-6
    # A picture in meters of the start's own plane.
    line = flight_figure(recording).axes[0].get_lines()[0].get_xydata()
    assert np.ptp(line[:, 1]) == pytest.approx(4.0, abs=0.05)
    assert np.ptp(line[:, 0]) < 0.05


@pytest.mark.parametrize("lat_deg", [90.0, -89.99])
def test_a_box_with_maneuvers_around_a_pole(lat_deg: float, cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    trains = [{"axis": axis, "amplitude_deg": 5.0, "period_s": 6.0} for axis in ("pitch", "roll", "yaw")]
    pattern = {"kind": "box", "leg_m": 7500.0, "maneuvers": trains, "north_m": -3600.0, "lead_s": 5.0}
    start = {"lat_deg": lat_deg, "lon_deg": 100.0, "heading_deg": 0.0, "alt_m": 3000.0}
    flight = fly(scenario_of(pattern, start=start, air=WIND), cessna)
    assert len(flight.maneuvers) == 12
    assert max(abs(train.flown_deg - 5.0) for train in flight.maneuvers) < 0.2
    assert max(train.residual_deg for train in flight.maneuvers) < 0.15
    assert flight.notes["closure_m"][0] < 10.0
    assert flight.notes["worst_leg_length_error_m"] < 10.0
    if lat_deg == 90.0:
        # Two of the first leg's maneuvers are flown right over it.
        assert from_axis_m(flight.carrier).min() < 20.0


def test_a_flight_may_begin_on_the_axis(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # The warm-up, 60 s of 75 m/s, begins exactly over the pole.
    start = {"lat_deg": 90.0, "lon_deg": 15.0, "heading_deg": 0.0}
    flight = fly(scenario_of({"kind": "straight", "leg_m": 1200.0, "north_m": 4500.0}, start=start), cessna)
    carrier = flight.carrier
    assert from_axis_m(carrier).min() == pytest.approx(4500.0 - 4.0 * 75.0, abs=10.0)
    assert np.degrees(np.ptp(carrier.steady_attitude, axis=0)).max() < 0.01
    assert flight.notes["worst_leg_length_error_m"] < 1.0


def test_ground_acts_over_the_pole(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    scenario = scenario_of(
        {"kind": "survey", "lines": 1, "line_m": 3000.0, "north_m": -1500.0, "drape_m": 150.0},
        start={"lat_deg": 90.0, "lon_deg": 0.0, "speed_mps": 65.0},
        terrain={"kind": "fractal", "seed": 3, "mean_m": 300.0, "relief_m": 150.0},
    )
    flight = fly(scenario, cessna)
    assert flight.notes["drape_worst_error_m"] < 30.0
    assert flight.notes["drape_lowest_above_ground_m"] > 100.0
