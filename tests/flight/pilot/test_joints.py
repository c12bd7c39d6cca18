"""Joints of segments: no control and no angular acceleration steps where one way of steering follows another."""

import math

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.flight.model.autopilot import RAMP_START, rate_of
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.pilot.calibration import loop_response
from magsim.trajectory import Flight
from tests.support.patterns import RATES, Joints, demands_of, flown, rate_bias_in_turns, shipped

TRAINS = [
    {"axis": "pitch", "amplitude_deg": 5.0, "period_s": 6.0, "rest_s": 12.0},
    {"axis": "roll", "amplitude_deg": 12.0, "period_s": 5.0},
    {"axis": "yaw", "amplitude_deg": 6.0, "period_s": 6.0, "rest_s": 8.0},
]
SWINGS = [
    {"axis": "pitch", "amplitude_deg": 5.0, "period_s": 8.0},
    {"axis": "roll", "amplitude_deg": 8.0, "period_s": 6.0, "phase_deg": 90.0},
    {"axis": "yaw", "amplitude_deg": 4.0, "period_s": 7.0},
]
COMBINED = [{"axis": "combined", "cycles": 3, "rest_s": 10.0, "swings": SWINGS}]
PARTS = [
    {"kind": "box", "leg_m": 7_000.0, "maneuvers": TRAINS},
    {"kind": "cloverleaf", "leaf_m": 3_000.0, "north_m": 2_000.0, "east_m": 20_000.0},
    {"kind": "heading_cross", "leg_m": 2_000.0, "circuits": 1, "north_m": 12_000.0, "turned_deg": [0.0, 120.0]},
    {"kind": "straight", "leg_m": 5_000.0, "maneuvers": COMBINED, "north_m": 20_000.0, "alt_m": 3_100.0},
    {"kind": "survey", "lines": 2, "line_m": 2_000.0, "ties": 1, "north_m": 30_000.0, "alt_m": 3_100.0},
]
"""Every kind of pattern in one flight, with a climb: 20 minutes."""

FLAPS = [{"deflection_deg": 10.0, "at_s": 30.0}, {"deflection_deg": 0.0, "at_s": 60.0}]
AXIS_RATES = {"pitch": "elevator_rate", "roll": "aileron_rate", "yaw": "rudder_rate"}


@pytest.fixture(scope="module", params=["c208b", "uav"])
def flight(request: pytest.FixtureRequest) -> Flight:
    """All kinds of patterns in wind."""
    start = {"lat_deg": 16.72, "lon_deg": 112.729, "alt_m": 3_000.0, "speed_mps": 75.0, "heading_deg": 350.0}
    pattern = {"kind": "sequence", "parts": PARTS}
    air = {"wind_north_mps": 4.0, "wind_east_mps": -6.0}
    raw = {"aircraft": "c208b", "start": start, "pattern": pattern, "air": air, "flight": {"flaps": FLAPS}}
    return flown(raw, request.param)


def test_nothing_outside_of_maneuvers_demands_more_than_they_do(flight: Flight) -> None:
    joints = Joints.of(flight)
    over = {name: joints.outside[name] / joints.inside[name] for name in RATES}
    assert max(over.values()) <= 1.0, (over, joints.where_s)


def test_the_end_of_a_train_is_calmer_than_the_train(flight: Flight) -> None:
    # Height hold came back at 20 to 35 deg/s of elevator, thirteen times what its train had used.
    time, demands = flight.carrier.time_s, demands_of(flight)
    for train in (m for m in flight.maneuvers if m.kind != "combined"):
        used = demands[AXIS_RATES[train.axis]]
        inside = (time >= train.start_s) & (time <= train.stop_s)
        ended = train.stop_s + train.ease_out_s
        # Until the next train of another axis begins to rise.
        following = [m.start_s - m.ease_in_s for m in flight.maneuvers if m.start_s > train.stop_s]
        after = (time > ended) & (time <= min([ended + 3.0, *following]))
        part = 0.4 if train.axis == "pitch" else 1.0
        assert used[after].max(initial=0.0) < part * used[inside].max(), train


@pytest.mark.parametrize(("aircraft", "most_dps"), [("c208b", 0.02), ("uav", 0.06)])
def test_the_nose_rests_after_a_pitch_train(aircraft: str, most_dps: float) -> None:
    # Loops that had to fly the swing by themselves left 0.04 and 0.20 deg/s.
    raw = shipped("patterns/straight")
    raw["pattern"] |= {"leg_m": 6_000.0, "maneuvers": [{"axis": "pitch", "amplitude_deg": 5.0, "period_s": 6.0}]}
    joints = Joints.of(flown(raw, aircraft))
    assert joints.joint_s == pytest.approx(3.0, abs=0.02)
    assert 0.0 < math.sqrt(joints.joint_power / joints.joint_s) < most_dps


@pytest.mark.parametrize(
    ("aircraft", "speed_mps", "alt_m"), [("c208b", 75.0, 3_000.0), ("c208b", 60.0, 1_000.0), ("uav", 25.0, 500.0)]
)
def test_a_pitch_swing_is_flown_as_asked_before_any_calibration(aircraft: str, speed_mps: float, alt_m: float) -> None:
    # Loops that had to fly it by themselves answered with 0.66 to 1.08 of it, up to 0.47 s late.
    setup = PlantSetup(0.0, 0.0, alt_m, 0.0, speed_mps)
    response = loop_response(load_aircraft(aircraft).facts, ["pitch"], setup)
    np.testing.assert_allclose(response.gain["pitch"], 1.0, atol=0.025)
    late_s = response.phase["pitch"] * response.period_s / (2.0 * math.pi)
    np.testing.assert_allclose(late_s, 0.0, atol=0.03)


def test_amplitudes_and_heights_are_kept(flight: Flight) -> None:
    for maneuver in flight.maneuvers:
        assert maneuver.flown_deg == pytest.approx(maneuver.asked_deg, abs=0.2), maneuver
    assert flight.notes["worst_leg_length_error_m"] < 50.0
    assert flight.notes["height_worst_error_m"] < 12.0


def test_a_drape_steps_no_control() -> None:
    raw = shipped("patterns/drape")
    raw["pattern"] |= {"lines": 2, "line_m": 4_000.0, "ties": 0}
    for aircraft, most in (("c208b", 6.0), ("uav", 12.0)):
        demands = Joints.of(flown(raw, aircraft)).outside
        # Turns at the planned bank, over the time in which it is established: 6 bank / ease^2 at most.
        assert demands["roll_accel"] < {"c208b": 9.4, "uav": 24.0}[aircraft]
        assert max(demands[name] for name in RATES if name.endswith("rate")) < most
        assert demands["pitch_accel"] < 0.5 * most


def test_rows_in_a_steady_turn_are_their_mean() -> None:
    # Set points in steps of a tick shook the ailerons in time with the rows: 0.4 deg/s of roll, 0.46 deg of aileron.
    raw = shipped("papers/001_fom")
    raw["pattern"] = {"kind": "box", "leg_m": 500.0, "lead_s": 0.0}
    for aircraft in ("c208b", "uav"):
        rate, aileron = rate_bias_in_turns(flown(raw, aircraft))
        assert 0.0 < rate < 0.02
        assert 0.0 < aileron < 0.02


def test_a_set_point_moves_through_north_at_every_step(cessna: Aircraft) -> None:
    plant = Plant(cessna.facts, PlantSetup(0.3, 2.0, 3000.0, math.radians(359.0), 75.0))
    fdm = plant._fdm
    plant.run(1)
    plant.command("ap/heading-rad", math.radians(359.5))
    plant.command(rate_of("ap/heading-rad"), math.radians(10.0))
    plant.command(RAMP_START, plant.clock_s)
    wanted = []
    for _ in range(24):
        plant.run(1)
        wanted.append(fdm["ap/heading-error-rad"] + fdm["attitude/psi-rad"])
    steps = np.diff(np.degrees(np.unwrap(wanted)))
    np.testing.assert_allclose(steps, 10.0 / 120.0, atol=1e-9)
    # The clock is advanced before the flight controls run.
    assert math.degrees(wanted[0]) == pytest.approx(359.5 + 10.0 / 120.0, abs=1e-9)
