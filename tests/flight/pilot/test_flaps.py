"""Flaps that move in flight: motor, limits, what the flight makes of it, switches."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.trim import trim
from magsim.flight.pilot.flaps import FlapSchedule, moving, runs_of
from magsim.loading import load_scenario
from magsim.scenario import FlapMove, Scenario
from magsim.trajectory import Flight

ScenarioOf = Callable[..., Scenario]

MOVES = [
    {"deflection_deg": 10.0, "at_s": 12.0},
    {"deflection_deg": 30.0, "leg": 2, "after_s": 5.0},
    {"deflection_deg": 0.0, "leg": 3},
]
SLOW = {"alt_m": 1000.0, "speed_mps": 60.0}


@pytest.fixture(scope="module")
def flapped(cessna: Aircraft, scenario_of: ScenarioOf) -> Flight:
    pattern = {"kind": "box", "leg_m": 3600.0, "lead_s": 0.0}
    return fly(scenario_of(pattern, start=SLOW, flight={"flaps": MOVES}), cessna)


def test_flaps_run_at_the_rate_of_their_motor(cessna: Aircraft, flapped: Flight) -> None:
    rate = math.degrees(cessna.facts.controls.flap.rate.value)
    time, angle = flapped.carrier.time_s, np.degrees(flapped.controls["flap"])
    legs = {s.leg: s.start_s for s in flapped.segments if not s.turn}
    expected = [(12.0, 0.0, 10.0), (legs[2] + 5.0, 10.0, 30.0), (legs[3], 30.0, 0.0)]
    assert len(flapped.notes["flap_runs"]) == 3
    for (moment, before, after), run in zip(expected, flapped.notes["flap_runs"], strict=True):
        # The lever is moved by the guidance, ten times a second.
        assert -0.04 <= run["start_s"] - moment <= 0.14
        assert run["stop_s"] - run["start_s"] == pytest.approx(abs(after - before) / rate, abs=0.04)
        assert (run["from_deg"], run["to_deg"]) == pytest.approx((before, after), abs=1e-9)
        inside = (time >= run["start_s"]) & (time <= run["stop_s"] - 0.05)
        line = before + np.sign(after - before) * rate * (time[inside] - run["start_s"])
        np.testing.assert_allclose(angle[inside], line, atol=1e-6)
    assert np.abs(np.diff(angle)).max() <= rate / 30.0 + 1e-9


def test_height_and_speed_are_held_while_flaps_run(flapped: Flight) -> None:
    rows = np.zeros(len(flapped.carrier), dtype=bool)
    for run in flapped.notes["flap_runs"]:
        rows |= (flapped.carrier.time_s > run["start_s"]) & (flapped.carrier.time_s < run["stop_s"] + 20.0)
    assert np.abs(flapped.carrier.alt_m[rows] - 1000.0).max() < 8.0
    speed = np.linalg.norm(flapped.carrier.velocity_n[rows], axis=1)
    assert np.abs(speed - 60.0).max() < 3.0


def test_moved_flaps_end_in_the_trim_of_flaps_that_were_set(cessna: Aircraft, flapped: Flight) -> None:
    # JSBSim's own trim, with the flaps where they end, knows nothing of how they got there.
    leg = next(s for s in flapped.segments if s.leg == 1 and not s.turn)
    rows = (flapped.carrier.time_s > leg.stop_s - 8.0) & (flapped.carrier.time_s < leg.stop_s - 2.0)
    for flap_deg, pitch in ((10.0, flapped.carrier.attitude[rows, 1].mean()), (0.0, flapped.carrier.attitude[60, 1])):
        setup = PlantSetup(0.0, 0.0, 1000.0, 0.0, 60.0, flap_rad=math.radians(flap_deg))
        assert math.degrees(pitch - trim(cessna.facts, setup).pitch) == pytest.approx(0.0, abs=0.15)


def test_switches_tell_the_loads(flapped: Flight) -> None:
    time = flapped.carrier.time_s
    assert set(flapped.switches) == {"flap_motor", "autopilot", "throttle"}
    assert (flapped.switches["autopilot"] == 1.0).all()
    motor, throttle = flapped.switches["flap_motor"], flapped.switches["throttle"]
    on = sum(run["stop_s"] - run["start_s"] for run in flapped.notes["flap_runs"])
    assert motor.sum() / 30.0 == pytest.approx(on, abs=0.05)
    moved = np.abs(np.gradient(flapped.controls["flap"])) > 1e-9
    assert (moved[motor == 1.0]).all()
    assert throttle.min() > 0.0
    assert throttle.max() <= 1.0
    # The drag of 30 degrees of flap needs more power than none.
    run = flapped.notes["flap_runs"][1]
    assert throttle[np.searchsorted(time, run["stop_s"] + 15.0)] > throttle[0] + 0.1


def test_a_flight_without_moves_keeps_its_flaps(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    flight = fly(scenario_of({"kind": "straight", "leg_m": 1000.0}, start=SLOW | {"flap_deg": 15.0}), cessna)
    assert flight.notes["flap_runs"] == []
    assert not flight.switches["flap_motor"].any()
    np.testing.assert_array_equal(flight.controls["flap"], np.full(len(flight.carrier), math.radians(15.0)))
    assert flight.carrier.alt_m == pytest.approx(1000.0, abs=0.2)


def test_runs_of_a_log() -> None:
    time, angle = np.arange(8) / 2.0, np.radians([0.0, 0.0, 2.0, 4.0, 4.0, 4.0, 3.0, 2.0])
    np.testing.assert_array_equal(moving(angle), [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    first, last = runs_of(time, angle)
    assert (first["start_s"], first["stop_s"], last["start_s"], last["stop_s"]) == (0.5, 1.5, 2.5, 3.5)
    assert (last["from_deg"], last["to_deg"]) == pytest.approx((4.0, 2.0))


def test_the_last_of_two_settings_at_once_holds() -> None:
    schedule = FlapSchedule([FlapMove(deflection_deg=20.0, at_s=2.0), FlapMove(deflection_deg=5.0, leg=1, after_s=2.5)])
    schedule.begin(60.0)
    assert schedule.setting(61.9) is None
    schedule.entered(1, 1, 60.0)
    assert math.degrees(schedule.setting(62.6)) == pytest.approx(5.0)
    schedule.check()


def test_a_move_that_was_not_made_is_reported() -> None:
    schedule = FlapSchedule([FlapMove(deflection_deg=10.0, leg=2, after_s=500.0)])
    schedule.begin(60.0)
    with pytest.raises(DataError, match=r"ended before flight.flaps\[0\], 10 deg at leg 2 of circuit 1 and 500 s;"):
        schedule.check()


@pytest.mark.parametrize(
    ("moves", "message"),
    [
        ([{"deflection_deg": 31.0, "leg": 1}], "31 is beyond the travel of c208b; allowed: 0 to 30"),
        ([{"deflection_deg": 30.0, "leg": 1}], r"30 deg of flap at 75 m/s, 64\.6 m/s indicated; .* up to 64\.3"),
        ([{"deflection_deg": 5.0, "leg": 5}], r"flaps\[0\]\.leg: 5 is not flown; allowed: 1 to 4"),
        ([{"deflection_deg": 5.0, "leg": 1, "circuit": 9}], r"flaps\[0\]\.circuit: 9 is not flown; allowed: 1 to"),
        ([{"deflection_deg": 5.0}], "allowed: either at_s, or leg"),
        ([{"deflection_deg": 5.0, "leg": 1, "at_s": 3.0}], "allowed: either at_s, or leg"),
        ([{"deflection_deg": 5.0, "circuit": 2, "at_s": 3.0}], "circuit and after_s belong to a leg"),
    ],
)
def test_moves_are_held_to_the_aircraft_and_the_pattern(moves: list, message: str) -> None:
    text = "[" + ",".join("{" + ",".join(f"{k}={v}" for k, v in move.items()) + "}" for move in moves) + "]"
    with pytest.raises(RequestError, match=message):
        load_scenario("calibration_c208b", (f"flight.flaps={text}",))


def test_an_aircraft_without_flaps_moves_none() -> None:
    with pytest.raises(RequestError, match="uav has no flaps; allowed: none"):
        load_scenario("papers/001_fom", ("flight.flaps=[{deflection_deg=0, leg=1}]",))
    assert load_aircraft("uav").facts.controls.flap is None


def test_a_track_brings_its_own_flaps() -> None:
    with pytest.raises(RequestError, match="a logged track has the flaps of its file; allowed: none"):
        load_scenario("patterns/track", ("flight.flaps=[{deflection_deg=10, at_s=5}]",))


def test_moments_that_never_come_are_refused(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    pattern = {"kind": "survey", "lines": 3, "line_m": 2000.0, "ties": 1, "tie_spacing_m": 500.0}
    for move, message in (
        ({"leg": 2, "circuit": 2}, r"circuit 2 has no leg 2; allowed: 1 to 1"),
        ({"at_s": 9000.0}, r"at_s: 9000 s is after the end of the flight; allowed: up to about \d+"),
    ):
        scenario = scenario_of(pattern, start=SLOW, flight={"flaps": [{"deflection_deg": 10.0} | move]})
        with pytest.raises(RequestError, match=message):
            fly(scenario, cessna)
