"""Parts of a sequence at heights of their own: the plan, the flight, what is refused."""

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import RequestError
from magsim.flight import fly
from magsim.flight.path.heights import ramps
from magsim.loading import load_scenario
from magsim.scenario import Scenario, ground_of
from magsim.streams import stream
from magsim.trajectory import Flight, Segment

ScenarioOf = Callable[..., Scenario]
CLIMB_MPS = 2.5
"""The Cessna's limit, in its facts.toml."""

TRAINS = [
    {"axis": "roll", "amplitude_deg": 10.0, "period_s": 5.0},
    {"axis": "pitch", "amplitude_deg": 5.0, "period_s": 7.0},
]
CLIMBING = [
    {"kind": "straight", "leg_m": 5000.0, "maneuvers": TRAINS},
    {"kind": "heading_cross", "circuits": 1, "turned_deg": [0.0], "leg_m": 6000.0, "north_m": 24500.0, "alt_m": 3400.0},
    {"kind": "straight", "leg_m": 4000.0, "north_m": 20000.0, "east_m": 12000.0, "heading_deg": 180.0, "alt_m": 3000.0},
]
HILLS = {"kind": "fractal", "mean_m": 400.0, "relief_m": 300.0, "geoid_m": 48.0}
DRAPED = {"kind": "survey", "lines": 2, "line_m": 4000.0, "spacing_m": 300.0, "drape_m": 100.0, "climb_slope": 0.04}


def rows_of(flight: Flight, segment: Segment) -> np.ndarray:
    return (flight.carrier.time_s >= segment.start_s) & (flight.carrier.time_s <= segment.stop_s)


@pytest.fixture(scope="module")
def climbing(cessna: Aircraft, scenario_of: ScenarioOf) -> Flight:
    parts = [CLIMBING[0], CLIMBING[1] | {"maneuvers": TRAINS[:1]}, CLIMBING[2]]
    return fly(scenario_of({"kind": "sequence", "parts": parts}, air={"wind_east_mps": 5.0}), cessna)


def test_each_part_is_flown_at_its_height(climbing: Flight) -> None:
    legs = [segment for segment in climbing.segments if not segment.turn]
    assert len(legs) == 3
    for leg, height, length in zip(legs, (3000.0, 3400.0, 3000.0), (5000.0, 6000.0, 4000.0), strict=True):
        alt = climbing.carrier.alt_m[rows_of(climbing, leg)]
        # A train of pitch swings the height by V A / omega.
        assert abs(np.median(alt) - height) < 6.0
        assert abs(alt[0] - height) < 2.0
        assert abs(leg.length_m - length) < 10.0
    assert climbing.notes["center_passes"][0]["height_error_m"] == pytest.approx(0.0, abs=6.0)
    assert climbing.notes["height_worst_error_m"] < 15.0
    assert not any(name.startswith("drape") for name in climbing.notes)


def test_transits_climb_and_descend_within_the_limit(climbing: Flight) -> None:
    up, down = (rows_of(climbing, segment) for segment in climbing.segments if segment.transit)
    climb = -climbing.carrier.velocity_n[:, 2]
    assert np.quantile(climb[up], 0.95) == pytest.approx(CLIMB_MPS * 75.0 / 80.0, rel=0.1)
    assert climb[up].max() < CLIMB_MPS + 0.3
    assert climb[down].min() > -CLIMB_MPS - 0.3
    # Up as late, down as early as can be, and nothing beyond the two heights.
    assert climbing.carrier.alt_m[up | down].min() > 2990.0
    assert climbing.carrier.alt_m[up | down].max() < 3410.0
    assert climb[up][: up.sum() // 10].max() < 0.5
    assert climb[down][-(down.sum() // 10) :].min() > -0.5


def test_amplitudes_are_closed_at_each_height(climbing: Flight) -> None:
    assert [train.circuit for train in climbing.maneuvers] == [1, 1, 2]
    assert max(abs(train.flown_deg - train.asked_deg) for train in climbing.maneuvers) < 0.1


def test_a_transit_too_short_for_its_climb_is_refused(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    near = [CLIMBING[0], CLIMBING[1] | {"north_m": 13000.0}]
    with pytest.raises(RequestError) as caught:
        fly(scenario_of({"kind": "sequence", "parts": near}), cessna)
    found = re.search(
        r"is (\d+) m long, but the climb from 3000 to 3400 m .* needs (\d+) m; .* up to (\d+) m", str(caught.value)
    )
    length, needed, reach = (float(number) for number in found.groups())
    assert str(caught.value).startswith("pattern.parts[1]: the transit before it")
    assert length == pytest.approx(5000.0, abs=1.0)
    # 400 m at 2.5 m/s and 75 m/s, 15 s to settle, and the rounding: 0.1 g at 75 m/s over 4 s V^2 / (0.1 g).
    rounding = 4.0 * (CLIMB_MPS / 75.0) * 75.0**2 / 0.980665
    assert needed == pytest.approx(400.0 * 75.0 / CLIMB_MPS + 15.0 * 75.0 + rounding, abs=60.0)
    assert reach == pytest.approx(400.0 - (needed - length) * CLIMB_MPS / 75.0, abs=1.0)
    # The limits in the message can be flown.
    for north, alt in ((13000.0 + needed - length + 5.0, 3400.0), (13000.0, 3000.0 + reach - 1.0)):
        parts = [CLIMBING[0] | {"maneuvers": []}, CLIMBING[1] | {"north_m": north, "alt_m": alt}]
        flight = fly(scenario_of({"kind": "sequence", "parts": parts}), cessna)
        assert flight.notes["height_worst_error_m"] < 3.0


def test_a_draped_survey_between_level_parts(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    parts = [
        {"kind": "straight", "leg_m": 2000.0},
        DRAPED | {"north_m": 17000.0},
        {"kind": "straight", "leg_m": 2000.0, "north_m": 2000.0, "east_m": -3000.0, "alt_m": 900.0},
    ]
    start = {"lat_deg": 46.5, "lon_deg": 8.0, "alt_m": 1000.0, "speed_mps": 65.0}
    scenario = scenario_of({"kind": "sequence", "parts": parts}, start=start, terrain=HILLS)
    flight = fly(scenario, cessna)
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    above = flight.carrier.alt_m - ground.height(flight.carrier.lat_rad, flight.carrier.lon_rad)
    first, last = (rows_of(flight, next(s for s in flight.segments if s.circuit == c and not s.turn)) for c in (1, 3))
    np.testing.assert_allclose(flight.carrier.alt_m[first], 1000.0, atol=2.0)
    np.testing.assert_allclose(flight.carrier.alt_m[last], 900.0, atol=2.0)
    lines = np.logical_or.reduce([rows_of(flight, s) for s in flight.segments if s.circuit == 2 and not s.turn])
    assert above[lines].min() == pytest.approx(flight.notes["drape_lowest_above_ground_m"])
    assert above[lines].min() > 90.0
    assert flight.notes["drape_worst_error_m"] < 10.0
    # It follows the ground, and the transits keep clear of it too.
    assert np.ptp(flight.carrier.alt_m[lines]) > 30.0
    assert above.min() > 90.0
    assert math.isclose(flight.carrier.time_s[0], -4.0)


def test_a_drape_next_to_a_low_level_part_is_refused(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    # The hills on the way are higher than the level part less the drape's clearance.
    parts = [{"kind": "straight", "leg_m": 2000.0}, DRAPED | {"north_m": 28000.0, "drape_m": 400.0}]
    start = {"lat_deg": 46.5, "lon_deg": 8.0, "alt_m": 700.0, "speed_mps": 65.0}
    with pytest.raises(
        RequestError, match=r"pattern\.parts\[0\]: the transits beside it, .* lead \d+ m off its heights"
    ):
        fly(scenario_of({"kind": "sequence", "parts": parts}, start=start, terrain=HILLS), cessna)


def test_ramps_of_many_slopes_are_the_lowest_profile() -> None:
    rng = stream(5, "slopes")
    slope = np.repeat(rng.uniform(0.01, 0.1, 6), 40)
    target = np.where(rng.uniform(size=240) < 0.05, rng.uniform(0.0, 60.0, 240), -np.inf)
    found = ramps(target, slope, 10.0)
    step = 10.0 * np.minimum(slope[1:], slope[:-1])
    way = np.concatenate([[0.0], np.cumsum(step)])
    np.testing.assert_allclose(found, (target[None, :] - np.abs(np.subtract.outer(way, way))).max(axis=1), atol=1e-9)
    assert (np.abs(np.diff(found)) <= step + 1e-9).all()


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            '[{kind="box", alt_m=3100}]',
            "parts[0].alt_m: 3100 m, but the flight begins with this pattern; allowed: start.alt_m, 3000",
        ),
        ('[{kind="box"}, {kind="box", alt_m=8000}]', "8000 m is above the ceiling of c208b; allowed: up to 7620"),
        ('[{kind="box"}, {kind="track", file="a.csv"}]', "'track' is not allowed; allowed: 'box'"),
    ],
)
def test_wrong_heights(parts: str, message: str) -> None:
    with pytest.raises(RequestError) as caught:
        load_scenario("patterns/sequence", (f"pattern.parts={parts}",))
    assert message in str(caught.value)


def test_wind_and_flaps_are_checked_at_every_height(scenario_of: ScenarioOf) -> None:
    sequence = {"kind": "sequence", "parts": [CLIMBING[0], CLIMBING[1] | {"alt_m": 7000.0}]}
    shear = {"kind": "linear", "north_per_s": 0.02}
    scenario_of({"kind": "box", "leg_m": 3000.0}, air={"shear": shear})
    with pytest.raises(ValueError, match=r"a wind that shear brings to 84\.0 m/s at 7200 m"):
        scenario_of(sequence, air={"shear": shear})
    low = {"kind": "sequence", "parts": [CLIMBING[0], CLIMBING[1] | {"alt_m": 500.0}]}
    flaps = {"flaps": [{"deflection_deg": 30.0, "leg": 1}]}
    scenario_of({"kind": "box", "leg_m": 3000.0}, start={"speed_mps": 70.0}, flight=flaps)
    with pytest.raises(ValueError, match=r"30 deg of flap at 70 m/s, 68\.\d m/s indicated"):
        scenario_of(low, start={"speed_mps": 70.0}, flight=flaps)
