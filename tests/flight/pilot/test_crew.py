"""Maneuvers as crews fly them: every cycle as it was drawn, and what is recorded of it."""

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from pydantic import ValidationError

from magsim.aircraft import Aircraft
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.scenario import Scenario, Train
from magsim.simulation import simulate
from magsim.trajectory import Flight
from magsim.units import G0

ScenarioOf = Callable[..., Scenario]
CREW = {"kind": "straight", "leg_m": 9_000.0, "preset": "crew"}
BARE = "field={induced={enabled=false}, memory={enabled=false}, eddy={enabled=false}}"
RANGES = {"roll": (5.0, 10.0), "pitch": (2.5, 5.0), "yaw": (2.5, 5.0)}


@pytest.fixture(scope="module")
def flight(cessna: Aircraft, scenario_of: ScenarioOf) -> Flight:
    return fly(scenario_of(CREW), cessna)


def test_the_preset_is_what_is_asked_for(scenario_of: ScenarioOf) -> None:
    trains = scenario_of(CREW).pattern.maneuvers
    assert [train.axis for train in trains] == ["pitch", "roll", "yaw"]
    for train in trains:
        assert isinstance(train, Train)
        low, high = RANGES[train.axis]
        assert all(low <= value <= high for value in train.amplitude_deg)
        assert all(4.0 <= value <= 8.0 for value in train.period_s)
        assert (train.amplitude_scatter, train.period_scatter) == (0.15, 0.10)
    assert trains[2].roll_part > 0.0
    given = [{"axis": "roll", "amplitude_deg": 6.0}]
    with pytest.raises(ValidationError, match="states the maneuvers too"):
        scenario_of(CREW | {"maneuvers": given})


def test_every_cycle_is_flown_as_it_was_drawn(flight: Flight) -> None:
    assert [maneuver.axis for maneuver in flight.maneuvers] == ["pitch", "roll", "yaw"]
    for maneuver in flight.maneuvers:
        cycles = maneuver.scattered
        assert len(cycles) == maneuver.cycles == 3
        assert len({cycle.asked_deg for cycle in cycles}) == len({cycle.period_s for cycle in cycles}) == 3
        assert sum(cycle.period_s for cycle in cycles) == pytest.approx(3.0 * maneuver.period_s)
        assert cycles[0].start_s == pytest.approx(maneuver.start_s)
        # In the first cycle the loops still follow the growing swing.
        for cycle in cycles[1:]:
            assert cycle.flown_deg == pytest.approx(cycle.asked_deg, abs=0.2), maneuver
        assert maneuver.asked_deg == cycles[1].asked_deg
        assert maneuver.residual_deg < 0.04 * maneuver.asked_deg + 0.1


def test_cycles_are_labeled_by_their_own_times(flight: Flight) -> None:
    for maneuver in flight.maneuvers:
        middles = np.array([cycle.start_s + 0.5 * cycle.period_s for cycle in maneuver.scattered])
        labels = flight.segment_columns(middles)
        np.testing.assert_array_equal(labels["cycle"], [1.0, 2.0, 3.0])
        starts = np.array([cycle.start_s for cycle in maneuver.scattered[1:]])
        np.testing.assert_array_equal(flight.segment_columns(starts - 0.01)["cycle"], [1.0, 2.0])
        np.testing.assert_array_equal(flight.segment_columns(starts + 0.01)["cycle"], [2.0, 3.0])


def test_a_crew_stays_within_its_loads(flight: Flight) -> None:
    time, carrier = flight.carrier.time_s, flight.carrier
    rows = (time >= 0.0) & (time <= flight.duration_s)
    # Along the normal of a nearly level aircraft.
    load = 1.0 - np.gradient(carrier.velocity_n[:, 2], time)[rows] / G0
    assert 0.2 < load.min() < 0.8
    assert 1.2 < load.max() < 1.8


def test_some_roll_goes_with_the_yaw(flight: Flight, cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    trains = [train.model_dump() for train in scenario_of(CREW).pattern.maneuvers]
    alone = [*trains[:2], trains[2] | {"roll_part": 0.0}]
    without = fly(scenario_of({"kind": "straight", "leg_m": 9_000.0, "maneuvers": alone}), cessna)
    assert (flight.maneuvers[2].roll_part, without.maneuvers[2].roll_part) == (0.3, 0.0)
    rolls = []
    for one in (flight, without):
        yaw = one.maneuvers[2]
        time = np.arange(yaw.start_s, yaw.stop_s, 0.05)
        rolls.append(np.degrees(one.carrier.at(time).attitude[:, 0]))
    # The difference is the part of the yaw that is asked for.
    asked = max(cycle.asked_deg for cycle in flight.maneuvers[2].scattered)
    assert 0.5 * np.ptp(rolls[0] - rolls[1]) == pytest.approx(0.3 * asked, rel=0.25)


def test_what_was_asked_of_each_cycle_is_recorded() -> None:
    short = "pattern={kind='straight', leg_m=4000.0, maneuvers=[{axis='roll', amplitude_deg=8.0, "
    short += "period_s=6.0, amplitude_scatter=0.15, period_scatter=0.1}]}"
    recording = simulate(load_scenario("crew_c208b", overrides=[short, "recording={train_circuits=[]}", BARE]))
    (train,) = recording.meta["maneuvers"]
    assert json.loads(json.dumps(train)) == train
    assert [sorted(cycle) for cycle in train["scattered"]] == [["asked_deg", "flown_deg", "period_s", "start_s"]] * 3
    first = train["scattered"][1]["start_s"]
    rows = recording["cycle"][(recording.time_s > first - 0.05) & (recording.time_s < first + 0.3)]
    assert set(rows) <= {1.0, 2.0}
    assert rows[-1] == 2.0


def test_the_seed_draws_the_cycles(flight: Flight, cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    first = scenario_of(CREW).pattern.maneuvers[0].model_dump()
    short = {"kind": "straight", "leg_m": 4_000.0, "maneuvers": [first]}
    drawn = [fly(scenario_of(short, seed=seed), cessna).maneuvers[0].scattered for seed in (1, 1, 2)]
    asked = [[(cycle.period_s, cycle.asked_deg) for cycle in cycles] for cycles in drawn]
    assert asked[0] == asked[1] == [(c.period_s, c.asked_deg) for c in flight.maneuvers[0].scattered]
    assert asked[0] != asked[2]


@pytest.mark.parametrize(
    ("train", "message"),
    [
        (
            {"axis": "roll", "amplitude_deg": 8.0, "cycles": 1, "period_scatter": 0.1},
            "period_scatter: one cycle takes the planned time; allowed: with two cycles or more",
        ),
        (
            {"axis": "roll", "amplitude_deg": 8.0, "roll_part": 0.2},
            "roll_part: roll takes no roll with it; allowed: for a yaw train",
        ),
        (
            {"axis": "yaw", "amplitude_deg": 14.0, "amplitude_scatter": 0.1},
            r"16\.94 deg is no yaw amplitude for c208b; allowed: above 0, up to 15",
        ),
        (
            {"axis": "yaw", "amplitude_deg": 4.0, "period_s": 3.2, "period_scatter": 0.1},
            r"2\.528 s is no maneuver period; allowed: 3 to 30",
        ),
        (
            {"axis": "pitch", "amplitude_deg": 4.5, "period_s": 6.0, "amplitude_scatter": 0.15, "period_scatter": 0.1},
            r"5\.92 deg of pitch in 4\.74 s swings from -0\.05 to 2\.05 g at 75 m/s; allowed for a crew: 0\.2 to 1\.8",
        ),
    ],
)
def test_scatter_beyond_what_can_be_flown_is_refused(scenario_of: ScenarioOf, train: dict, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        scenario_of({"kind": "straight", "leg_m": 9_000.0, "maneuvers": [train]})


def test_the_shipped_flight_is_flown_by_a_crew() -> None:
    pattern = load_scenario("crew_c208b").scenario.pattern
    assert pattern.preset == "crew"
    assert not pattern.allow_beyond_crew_g
    assert math.isclose(pattern.leg_m, 9_000.0)
