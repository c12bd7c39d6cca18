"""Surveys: where the lines lie, the height plan against its definition, how a drape is flown, wrong settings."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.flight.path.heights import STEP_M, VERTICAL_G, plan_heights, ramps, rounded, window_of
from magsim.flight.path.patterns import path_of
from magsim.loading import load_scenario
from magsim.scenario import Scenario, SurveyPattern, ground_of
from magsim.streams import stream
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight
from magsim.units import G0

ScenarioOf = Callable[..., Scenario]
LEVEL = {"kind": "survey", "lines": 3, "line_m": 4000.0, "spacing_m": 300.0, "ties": 2, "tie_spacing_m": 2500.0}
HILLS = {"kind": "fractal", "mean_m": 400.0, "relief_m": 300.0, "geoid_m": 48.0}
DRAPE = LEVEL | {"drape_m": 100.0, "climb_slope": 0.04}
LOW = {"lat_deg": 46.5, "lon_deg": 8.0, "alt_m": 800.0, "speed_mps": 65.0}


@pytest.fixture(scope="module")
def draped(cessna: Aircraft, scenario_of: ScenarioOf) -> tuple[Scenario, Flight]:
    scenario = scenario_of(DRAPE, start=LOW, terrain=HILLS)
    return scenario, fly(scenario, cessna)


@pytest.mark.parametrize("turn", ["right", "left"])
@pytest.mark.parametrize("lines", [1, 4, 5])
def test_lines_and_ties_lie_where_they_should(turn: str, lines: int):
    survey = SurveyPattern(lines=lines, line_m=6000.0, spacing_m=400.0, ties=3, tie_spacing_m=2000.0, turn=turn)
    path = path_of(survey, 0.0, 70.0, 2.0)
    side = 1.0 if turn == "right" else -1.0
    legs = [element for element in path if not element.turn]
    assert [(leg.circuit, leg.leg) for leg in legs] == [(1, i + 1) for i in range(lines)] + [(2, 1), (2, 2), (2, 3)]
    for i, leg in enumerate(legs[:lines]):
        start, stop = leg.at(0.0), leg.at(leg.length_m)
        assert (start.east_m, stop.east_m) == pytest.approx((side * 400.0 * i,) * 2, abs=1e-6)
        assert (start.north_m, stop.north_m) == pytest.approx((6000.0, 0.0) if i % 2 else (0.0, 6000.0), abs=1e-6)
        assert leg.heading_deg == 180.0 * (i % 2)
    width = 400.0 * (lines - 1)
    norths = [1000.0, 3000.0, 5000.0]
    for i, leg in enumerate(legs[lines:]):
        ends = sorted(side * leg.at(along).east_m for along in (0.0, leg.length_m))
        assert ends == pytest.approx([-500.0, width + 500.0], abs=1e-6)
        # the first tie line is the one near the end of the last line
        assert leg.at(0.0).north_m == pytest.approx(norths[::-1][i] if lines % 2 else norths[i], abs=1e-6)
        assert leg.at(10.0).north_m == pytest.approx(leg.at(0.0).north_m, abs=1e-6)
    for one, other in pairwise(path):
        end, begin = one.at(one.length_m), other.at(0.0)
        assert math.hypot(end.north_m - begin.north_m, end.east_m - begin.east_m) < 0.05
        assert math.cos(end.course - begin.course) == pytest.approx(1.0, abs=1e-9)


def test_every_line_is_entered_straight():
    survey = SurveyPattern(lines=3, line_m=3000.0, spacing_m=200.0, ties=2, tie_spacing_m=1000.0, lead_s=6.0)
    path = path_of(survey, 77.0, 70.0, 2.0)
    for before, leg in pairwise(path):
        if not leg.turn:
            assert before.turn
            assert before.length_m == pytest.approx(420.0)
            assert before.curvature(100.0) == 0.0


def test_a_level_survey_is_flown(cessna: Aircraft, scenario_of: ScenarioOf):
    flight = fly(scenario_of(LEVEL, start={"heading_deg": 30.0}, air={"wind_east_mps": 8.0}), cessna)
    legs = [segment for segment in flight.segments if not segment.turn]
    assert [round(leg.heading_deg) for leg in legs] == [30, 210, 30, 300, 120]
    assert [leg.length_m for leg in legs] == pytest.approx([4000.0] * 3 + [1600.0] * 2, abs=5.0)
    plane = TangentPlane(*np.radians([16.72, 112.729]), 3000.0)
    course = math.radians(30.0)
    for number, leg in enumerate(legs[:3]):
        at = flight.carrier.at(np.arange(leg.start_s, leg.stop_s, 0.5))
        north, east = plane.place(at.lat_rad, at.lon_rad)
        aside = east * math.cos(course) - north * math.sin(course)
        assert np.abs(aside - 300.0 * number).max() < 8.0
        assert np.abs(at.alt_m - 3000.0).max() < 3.0
        assert np.degrees(np.abs(at.attitude[:, 0])).max() < 3.0
    assert not any(name.startswith("drape") for name in flight.notes)


def test_ramps_are_the_lowest_profile():
    target = stream(3, "target").uniform(0.0, 80.0, 300)
    found = ramps(target, 0.05, 10.0)
    distance = 10.0 * np.abs(np.subtract.outer(np.arange(300), np.arange(300)))
    np.testing.assert_allclose(found, (target[None, :] - 0.05 * distance).max(axis=1), atol=1e-9)


def test_rounding_keeps_planes_and_bounds_the_bend():
    ramp = 0.04 * 10.0 * np.arange(400)
    np.testing.assert_allclose(rounded(ramp, 600.0, 10.0)[40:-40], ramp[40:-40], atol=1e-9)
    speed = 70.0
    crest = -0.04 * 10.0 * np.abs(np.arange(801) - 400.0)
    smooth = rounded(crest, window_of(0.04, speed), 10.0)
    bend = np.diff(smooth, 2) / 100.0
    assert np.abs(bend[50:-50]).max() * speed**2 == pytest.approx(VERTICAL_G * G0, rel=0.03)


def test_the_plan_clears_its_target_and_keeps_its_slope():
    target = np.cumsum(stream(4, "target").normal(0.0, 4.0, 3000))
    heights, lift = plan_heights(target, 0.04, window_of(0.04, 70.0), STEP_M)
    assert np.min(heights - target) >= -1e-9
    assert np.abs(np.diff(heights)).max() <= 0.04 * STEP_M + 1e-9
    assert np.abs(np.diff(heights, 2)).max() / STEP_M**2 * 70.0**2 < 1.1 * VERTICAL_G * G0
    assert 0.0 < lift < 0.16 * 0.04 * window_of(0.04, 70.0)


def test_level_ground_gives_a_level_plan():
    heights, lift = plan_heights(np.full(200, 321.0), 0.04, window_of(0.04, 70.0), STEP_M)
    np.testing.assert_allclose(heights, 321.0, atol=1e-9)
    assert lift < 1e-9


def test_a_drape_is_flown(draped: tuple[Scenario, Flight]):
    """Above ground by the clearance less the flown error, within 5 m of the plan in calm air."""
    scenario, flight = draped
    notes = flight.notes
    assert notes["drape_worst_error_m"] < 5.0
    assert notes["drape_lowest_above_ground_m"] > 95.0
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    carrier = flight.carrier
    above = carrier.alt_m - ground.height(carrier.lat_rad, carrier.lon_rad)
    assert above.min() > 85.0  # turns too
    lines = np.zeros(len(carrier), dtype=bool)
    for segment in flight.segments:
        if not segment.turn:
            lines |= (carrier.time_s >= segment.start_s) & (carrier.time_s <= segment.stop_s)
    assert above[lines].min() == pytest.approx(notes["drape_lowest_above_ground_m"])
    slope = carrier.velocity_n[lines, 2] / np.hypot(*carrier.velocity_n[lines, :2].T)
    assert np.abs(slope).max() < 0.045
    assert np.abs(slope).max() > 0.03
    # it does follow the ground: a level flight over the highest point would be far higher
    assert above[lines].mean() < 200.0


def test_the_plan_touches_its_clearance_somewhere(draped: tuple[Scenario, Flight]):
    assert draped[1].notes["drape_lowest_above_ground_m"] < 110.0


def test_a_drape_in_wind(cessna: Aircraft, scenario_of: ScenarioOf):
    scenario = scenario_of(DRAPE | {"ties": 0}, start=LOW, terrain=HILLS, air={"wind_north_mps": 10.0})
    assert fly(scenario, cessna).notes["drape_worst_error_m"] < 5.0


def test_a_drape_that_the_engine_cannot_climb(cessna: Aircraft, scenario_of: ScenarioOf):
    """A climb of 20 % at 75 m/s is 15 m/s: not for a Caravan."""
    hills = HILLS | {"relief_m": 3000.0, "mean_m": 2500.0, "longest_m": 20_000.0}
    pattern = DRAPE | {"line_m": 20_000.0, "climb_slope": 0.2, "lines": 1, "ties": 0}
    with pytest.raises(DataError, match=r"hold its drape|stalled|touched the ground|throttle at its upper stop"):
        fly(scenario_of(pattern, start=LOW | {"speed_mps": 75.0}, terrain=hills), cessna)


def test_a_drape_above_the_ceiling(cessna: Aircraft, scenario_of: ScenarioOf):
    scenario = scenario_of(DRAPE, start=LOW, terrain={"kind": "flat", "height_m": 7600.0})
    with pytest.raises(RequestError, match=r"pattern.drape_m: 100 m above this ground reaches 7700 m .* 7620 m"):
        fly(scenario, cessna)


def test_start_height_does_not_move_a_drape(cessna: Aircraft, scenario_of: ScenarioOf, draped: tuple[Scenario, Flight]):
    """Below the ground even: the height belongs to the plane of the pattern alone."""
    short = DRAPE | {"lines": 1, "ties": 0, "line_m": 2000.0}
    one, other = (fly(scenario_of(short, start=LOW | {"alt_m": alt}, terrain=HILLS), cessna) for alt in (10.0, 800.0))
    assert one.carrier.alt_m[0] == pytest.approx(other.carrier.alt_m[0], abs=1.0)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["pattern.tie_spacing_m=9000"], "2 tie lines 9000 m apart take 9000 m, more than a line of 8000 m"),
        (["pattern.lines=1", "pattern.tie_overlap_m=10"], "tie lines would be 20 m long"),
        (["pattern.line_m=100"], "line_m"),
        (["pattern.lines=0"], "lines"),
        (["pattern.drape_m=5"], "drape_m"),
        (["pattern.climb_slope=0.9"], "climb_slope"),
        (["pattern.maneuvers=[]"], "maneuvers"),
        (["recording.train_circuits=[3]"], "3 is not flown; allowed: 1 to 2"),
        (["recording.valid_legs=[7]"], "7 is not flown; allowed: 1 to 6"),
    ],
)
def test_wrong_settings(overrides: list[str], message: str):
    with pytest.raises(RequestError) as caught:
        load_scenario("patterns/survey", overrides)
    assert message in str(caught.value)


def test_a_drape_needs_ground_and_no_height(scenario_of: ScenarioOf):
    with pytest.raises(ValueError, match="a drape needs the ground"):
        scenario_of(DRAPE)
    with pytest.raises(ValueError, match=r"a draped survey follows the ground; allowed: drape_m or alt_m"):
        scenario_of({"kind": "sequence", "parts": [LEVEL, DRAPE | {"alt_m": 900.0}]}, terrain=HILLS)


def test_a_survey_after_a_box(cessna: Aircraft, scenario_of: ScenarioOf):
    parts = [{"kind": "box", "leg_m": 2000.0}, LEVEL | {"lines": 2, "ties": 0, "north_m": 3000.0}]
    flight = fly(scenario_of({"kind": "sequence", "parts": parts}), cessna)
    legs = [(segment.circuit, segment.leg) for segment in flight.segments if not segment.turn]
    assert legs == [(1, 1), (1, 2), (1, 3), (1, 4), (2, 1), (2, 2)]
