"""How often loads are on in training rows: counted by hand, and at least three times in every shipped scenario."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import assets
from magsim.field.wiring.electronics import Clock, onboard, training_spans
from magsim.loading import LoadedScenario, load_scenario
from magsim.recording.plausibility import LEAST_TIMES_ON
from magsim.scenario import TrackPattern, parts_of
from magsim.simulation.loads import spans_touched, times_on
from magsim.trajectory import Flight, Segment, Trajectory
from magsim.truth import FieldTruth

RATE, TURN_S = 30.0, 40.0


def planned(loaded: LoadedScenario) -> Flight:
    """The legs of a scenario one after the other, with turns of 40 s, and its flap moves: nothing is flown."""
    speed, segments, time = loaded.scenario.start.speed_mps, [], 0.0
    for number, part in enumerate(parts_of(loaded.scenario.pattern)):
        for index in range(part.legs * part.circuits):
            where, leg_s = (number + 1 + index // part.legs, index % part.legs + 1), part.leg_m / speed
            segments.append(Segment(*where, False, 0.0, time, time + leg_s, part.leg_m))
            segments.append(Segment(*where, True, 0.0, time + leg_s, time + leg_s + TURN_S, TURN_S * speed))
            time += leg_s + TURN_S
    t = np.arange(round(-4 * RATE), round((time + 4.0) * RATE) + 1) / RATE
    motor = np.zeros(len(t))
    starts = {(s.circuit, s.leg): s.start_s for s in segments if not s.turn}
    for move in loaded.scenario.flight.flaps:
        begin = (move.at_s if move.leg is None else starts[move.circuit, move.leg] + move.after_s) or 0.0
        motor[(t >= begin) & (t < begin + 5.0)] = 1.0
    still = np.zeros((len(t), 3))
    carrier = Trajectory(t, 0.0 * t, 0.0 * t, 0.0 * t, still, still, still)
    switches = {"flap_motor": motor, "autopilot": 1.0 + 0.0 * t}
    return Flight(carrier, time, RATE, {}, tuple(segments), (), switches=switches)


def counted(loaded: LoadedScenario) -> dict[str, int]:
    flight, truths = planned(loaded), {}
    for body, vehicle in (("carrier", loaded.aircraft), ("bird", loaded.bird)):
        if vehicle is not None:
            t = flight.carrier.time_s
            spans = training_spans(flight.segments, loaded.scenario.recording)
            clock = Clock(t, 1.0 / RATE, flight, loaded.scenario.seed, spans)
            drawn = onboard(vehicle.magnetics, loaded.scenario.field.electronics, clock)
            truths[body] = FieldTruth(t, (), {}, currents_a=drawn.currents_a)
    return times_on(loaded, flight, truths)


def with_training() -> list[str]:
    """Names of the shipped scenarios that fly legs for training; a logged track is recorded in another test."""
    names = []
    for name in assets.list_scenarios():
        scenario = load_scenario(name).scenario
        if not isinstance(scenario.pattern, TrackPattern) and scenario.recording.train_circuits:
            names.append(name)
    return names


@pytest.mark.parametrize("name", with_training())
def test_every_load_of_a_shipped_scenario_is_on_three_times_in_training_rows(name: str) -> None:
    for seed in range(5):
        loaded = load_scenario(name, ["field.electronics.enabled=true", f"seed={seed}"])
        times = counted(loaded)
        assert all(count >= LEAST_TIMES_ON for count in times.values()), (seed, times)
        if loaded.aircraft.name == "c208b":
            assert {"com_1", "strobe", "fuel_pump", "ins_heater"} <= set(times)
            assert ("flap" in times) == bool(loaded.scenario.flight.flaps)


def test_without_the_key_a_radio_may_transmit_once() -> None:
    often = [counted(load_scenario("electronics_c208b", [f"seed={seed}"]))["com_1"] for seed in range(8)]
    setting = "field.electronics.least_times_on=0"
    rare = [counted(load_scenario("electronics_c208b", [f"seed={seed}", setting]))["com_1"] for seed in range(8)]
    assert min(often) >= 3
    assert min(rare) < 3


def test_runs_that_touch_training_rows_are_counted() -> None:
    on = np.array([1, 1, 0, 1, 0, 1, 1, 1, 0, 0, 1], dtype=bool)
    train = np.array([0, 1, 1, 0, 0, 0, 1, 0, 0, 1, 0], dtype=bool)
    assert spans_touched(on, train) == 2  # the first and the third run
    assert spans_touched(on, np.ones(11, dtype=bool)) == 4
    assert spans_touched(on, np.zeros(11, dtype=bool)) == 0
    assert spans_touched(np.zeros(11, dtype=bool), train) == 0


def test_loads_that_rest_or_never_rest_are_constant_currents() -> None:
    loaded = load_scenario("electronics_c208b")
    flight = planned(loaded)
    t = flight.carrier.time_s
    com = 6.0 * ((t > 20.0) & (t < 24.0)) + 6.0 * ((t > 700.0) & (t < 704.0))  # once on leg 1, once in the test
    currents = {"com_1": com, "strobe": 0.3 + 8.0 * (t % 1.0 < 0.5), "fuel_pump": 4.5 + 0.0 * t, "flap": 0.0 * t}
    truth = FieldTruth(t, (), {}, currents_a=currents)
    times = times_on(loaded, flight, {"carrier": truth})
    assert set(times) == {"com_1", "strobe"}
    assert times["com_1"] == 1
    assert times["strobe"] == pytest.approx(3 * (10_000.0 / 75.0 + TURN_S), abs=2)
    untrained = replace(loaded, scenario=load_scenario("electronics_c208b", ["recording.train_circuits=[]"]).scenario)
    assert times_on(untrained, flight, {"carrier": truth}) == {}
