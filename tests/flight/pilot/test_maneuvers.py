"""Flown maneuvers: amplitudes on every heading, limits, passes of a center, transits."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.earth import ecef_from_geodetic
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.carriers.outcome import check_quiet
from magsim.flight.pilot.trains import SineTrain
from magsim.loading import load_scenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight
from tests.benchmarks.flight_accuracy import (
    AMPLITUDES_DEG,
    AXES,
    COMBINED,
    amplitude_flight,
    combined_flight,
    combined_maneuvers,
    half_peak_errors_deg,
    is_refused,
    leg_error_m,
)

ScenarioOf = Callable[..., Scenario]


@pytest.mark.parametrize("aircraft", ["c208b", "uav"])
def test_half_of_peak_to_peak_is_the_commanded_amplitude(aircraft: str) -> None:
    flight = amplitude_flight(aircraft)
    errors = half_peak_errors_deg(flight)
    limits = load_aircraft(aircraft).limits.amplitude_deg
    pairs = {(axis, amplitude) for axis in AXES for amplitude in AMPLITUDES_DEG}
    assert set(errors) == {(axis, amplitude) for axis, amplitude in pairs if amplitude <= limits[axis]}
    assert len(flight.maneuvers) == 4 * len(errors)
    assert max(errors.values()) < 0.2
    assert leg_error_m(flight) < 50.0
    for axis, amplitude in pairs - set(errors):
        assert is_refused(axis, amplitude, aircraft)


@pytest.mark.parametrize(("aircraft", "names"), [("c208b", tuple(COMBINED)), ("uav", ("all_axes_three_periods",))])
def test_combined_maneuvers_are_flown_as_commanded(aircraft: str, names: tuple[str, ...]) -> None:
    flight = combined_flight(names, aircraft)
    assert [s.heading_deg for s in flight.segments if not s.turn] == [0.0, 90.0, 180.0, 270.0]
    assert all(maneuver.kind == "combined" for maneuver in flight.maneuvers)
    for name, maneuvers in combined_maneuvers(flight, names).items():
        errors = half_peak_errors_deg(flight, maneuvers)
        assert set(errors) == {(axis, amplitude) for axis, amplitude, _ in COMBINED[name]}
        assert len(maneuvers) == 4 * len(COMBINED[name])
        assert max(errors.values()) < 0.2
        for maneuver in maneuvers:
            assert maneuver.flown_deg == pytest.approx(maneuver.asked_deg, abs=0.2)
    # Straight on after the maneuvers, and back on the line at the end of the leg.
    assert leg_error_m(flight) < 50.0


@pytest.mark.parametrize(
    ("train", "start", "message"),
    [
        (
            {"axis": "pitch", "amplitude_deg": 10.0, "period_s": 5.0},
            {"speed_mps": 50.0},
            (
                r"10 deg of pitch in 5 s \(leg 1 of circuit 1\) goes beyond the stall at 50 m/s and 3000 m; allowed "
                r"for Cessna 208B Grand Caravan: up to 7(\.\d)? deg in that period, or a period of (7|8)\.\d s"
            ),
        ),
        (
            {"axis": "yaw", "amplitude_deg": 15.0, "period_s": 3.0},
            {"speed_mps": 55.0},
            r"15 deg of yaw in 3 s .* more rudder than available at 55 m/s .* up to 11\.\d deg .* a period of 3\.\d s",
        ),
        (
            {"axis": "roll", "amplitude_deg": 25.0, "period_s": 3.0},
            {"speed_mps": 65.0},
            r"25 deg of roll in 3 s .* more aileron than available at 65 m/s .* to 21(\.\d)? deg .* of 3\.\d s",
        ),
    ],
)
def test_more_than_controls_and_lift_can_give_is_refused(
    cessna: Aircraft, scenario_of: ScenarioOf, train: dict, start: dict, message: str
) -> None:
    pattern = {"kind": "straight", "leg_m": 5000.0, "allow_beyond_crew_g": True, "maneuvers": [train]}
    with pytest.raises(RequestError, match=message):
        fly(scenario_of(pattern, start=start), cessna)


@pytest.mark.parametrize(
    ("train", "speed_mps"),
    [
        ({"axis": "roll", "amplitude_deg": 25.0, "period_s": 8.0}, 75.0),
        ({"axis": "pitch", "amplitude_deg": 9.5, "period_s": 8.0}, 50.0),
    ],
)
def test_a_train_near_its_limits_is_flown_as_commanded(
    cessna: Aircraft, scenario_of: ScenarioOf, train: dict, speed_mps: float
) -> None:
    # Here the loops do not respond in proportion: calibrated by smaller amplitudes they miss by 0.25 to 0.4 deg.
    pattern = {"kind": "straight", "leg_m": 4500.0, "allow_beyond_crew_g": True, "maneuvers": [train]}
    (flown,) = fly(scenario_of(pattern, start={"speed_mps": speed_mps}), cessna).maneuvers
    assert flown.flown_deg == pytest.approx(train["amplitude_deg"], abs=0.2)
    assert flown.half_peak_to_peak_deg == pytest.approx(train["amplitude_deg"], abs=0.2)


@pytest.mark.parametrize(("speed_mps", "alt_m"), [(55.0, 3000.0), (65.0, 7600.0)])
def test_a_slow_yaw_train_keeps_clear_of_the_stall(
    cessna: Aircraft, scenario_of: ScenarioOf, speed_mps: float, alt_m: float
) -> None:
    # Long periods with the heading held leave the line far off; the turn back to it must not stall the wing.
    trains = [{"axis": "yaw", "amplitude_deg": 8.0, "period_s": 20.0, "rest_s": 30.0}]
    pattern = {"kind": "straight", "leg_m": 140.0 * speed_mps, "maneuvers": trains}
    start = {"speed_mps": speed_mps, "alt_m": alt_m}
    flight = fly(scenario_of(pattern, start=start), cessna)
    (train,) = flight.maneuvers
    assert train.flown_deg == pytest.approx(8.0, abs=0.2)
    assert flight.notes["worst_leg_length_error_m"] < 50.0


@pytest.fixture(scope="module")
def cloverleaf() -> Flight:
    loaded = load_scenario("patterns/cloverleaf")
    assert math.hypot(loaded.scenario.air.wind_north_mps, loaded.scenario.air.wind_east_mps) == 10.0
    return fly(loaded.scenario, loaded.aircraft)


def test_a_cloverleaf_with_maneuvers_crosses_its_center_in_wind(cloverleaf: Flight) -> None:
    center = ecef_from_geodetic(math.radians(16.72), math.radians(112.729), 3000.0)
    passes = [segment for segment in cloverleaf.segments if not segment.turn]
    assert [leg.heading_deg for leg in passes] == [0.0, 270.0, 180.0, 90.0]
    for leg, entry in zip(passes, cloverleaf.notes["center_passes"], strict=True):
        assert abs(leg.length_m - 10_000.0) < 50.0
        at = cloverleaf.carrier.at(np.arange(leg.start_s, leg.stop_s, 0.005))
        places = ecef_from_geodetic(at.lat_rad, at.lon_rad, np.full(len(at), 3000.0))
        miss = np.linalg.norm(places - center, axis=1)
        nearest = int(miss.argmin())
        assert miss[nearest] < 25.0
        assert abs(at.alt_m[nearest] - 3000.0) < 3.0
        assert (entry["circuit"], entry["leg"], entry["heading_deg"]) == (leg.circuit, leg.leg, leg.heading_deg)
        assert entry["time_s"] == pytest.approx(at.time_s[nearest], abs=0.05)
        assert entry["miss_m"] == pytest.approx(miss[nearest], abs=0.5)
        assert entry["height_error_m"] == pytest.approx(at.alt_m[nearest] - 3000.0, abs=0.2)


def test_every_pass_has_its_maneuvers_but_none_at_the_center(cloverleaf: Flight) -> None:
    for entry in cloverleaf.notes["center_passes"]:
        own = [m for m in cloverleaf.maneuvers if m.leg == entry["leg"]]
        assert {m.axis for m in own} == {"pitch", "roll", "yaw"}
        time = np.arange(entry["time_s"] - 10.0, entry["time_s"] + 10.0, 0.1)
        assert not cloverleaf.segment_columns(time)["maneuver"].any()
        # No maneuver: only the end of settling, and the way back of some meters to the line.
        assert np.degrees(np.ptp(cloverleaf.carrier.at(time).attitude[:, :2], axis=0)).max() < 1.5


def test_a_maneuver_near_a_center_is_reported() -> None:
    entry = {"circuit": 1, "leg": 2, "time_s": 60.0}
    fine = SineTrain("roll", 1, 2, 30.0, 6.0, 3, 10.0, 3.0, 2.0)
    late = SineTrain("roll", 1, 2, 32.0, 6.0, 3, 10.0, 3.0, 2.0)
    check_quiet(entry, [fine], 10.0)
    with pytest.raises(DataError, match=r"roll maneuver of leg 2, circuit 1 was flown 8\.0 s from the center"):
        check_quiet(entry, [late], 10.0)


def test_a_sequence_is_flown_through(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    roll = [{"axis": "roll", "amplitude_deg": 10.0, "period_s": 5.0}]
    parts = [
        {"kind": "straight", "leg_m": 3000.0, "maneuvers": roll},
        {"kind": "heading_cross", "circuits": 1, "leg_m": 3000.0, "north_m": 6000.0, "turned_deg": [0.0, 120.0]},
        {"kind": "box", "leg_m": 2000.0, "order": [1, 3, 2, 4], "heading_deg": 200.0, "east_m": 4000.0},
    ]
    pattern = {"kind": "sequence", "parts": parts}
    flight = fly(scenario_of(pattern, air={"wind_east_mps": 6.0, "wind_north_mps": -8.0}), cessna)
    kinds = [(s.circuit, s.leg, s.turn, s.transit) for s in flight.segments]
    assert kinds[:5] == [
        (1, 1, False, False),
        (1, 1, True, True),
        (2, 1, False, False),
        (2, 1, True, False),
        (2, 2, False, False),
    ]
    assert kinds[5] == (2, 2, True, True)
    assert kinds[6:] == [(3, leg, turn, False) for leg in (1, 2, 3, 4) for turn in (False, True)]
    assert [s.heading_deg for s in flight.segments if not s.turn] == [0.0, 0.0, 120.0, 200.0, 20.0, 290.0, 110.0]
    assert flight.notes["worst_leg_length_error_m"] < 50.0
    assert max(flight.notes["center_miss_m"]) < 25.0
    assert max(flight.notes["closure_m"]) < 50.0
    labels = flight.segment_columns(np.array([s.start_s + 0.5 for s in flight.segments]))
    np.testing.assert_array_equal(labels["transit"], [s.transit for s in flight.segments])
    assert [m.circuit for m in flight.maneuvers] == [1]


def test_several_axes_oscillate_at_once(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    swings = [
        {"axis": "pitch", "amplitude_deg": 5.0, "period_s": 8.0},
        {"axis": "roll", "amplitude_deg": 8.0, "period_s": 6.0, "phase_deg": 90.0},
    ]
    trains = [{"axis": "combined", "cycles": 4, "swings": swings}]
    flight = fly(scenario_of({"kind": "straight", "leg_m": 6000.0, "maneuvers": trains}), cessna)
    pitch, roll = flight.maneuvers
    assert (pitch.axis, roll.axis, pitch.kind, roll.kind) == ("pitch", "roll", "combined", "combined")
    assert (pitch.cycles, roll.cycles) == (4, 5)
    assert roll.start_s - pitch.start_s == pytest.approx(1.5)
    assert pitch.flown_deg == pytest.approx(5.0, abs=0.2)
    assert roll.flown_deg == pytest.approx(8.0, abs=0.2)
    labels = flight.segment_columns(np.array([pitch.start_s + 0.1, roll.stop_s - 0.1, pitch.stop_s + 0.1]))
    np.testing.assert_array_equal(labels["maneuver"], [4.0, 4.0, 0.0])
    np.testing.assert_array_equal(labels["cycle"], [1.0, 5.0, 0.0])
