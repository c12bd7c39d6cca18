"""The air of a flight: shear and gusts by formulas, turbulence after MIL-F-8785C, all of it recorded."""

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Callable
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.errors import DataError
from magsim.flight import fly
from magsim.flight.model.air_xml import weather_xml
from magsim.flight.model.dryden import Strength
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.weather import Weather, drawn_gusts
from magsim.flight.pilot.gusts import GustSchedule
from magsim.scenario import Air, Gust, LinearShear, LogShear, RandomGusts, Scenario
from magsim.trajectory import Flight
from magsim.units import FT
from tests.benchmarks.realism_rows.gusts import roll_rms_deg
from tests.support.paths import ROOT

ScenarioOf = Callable[..., Scenario]

WIND = (4.0, -2.0)
SHORT = {"kind": "straight", "leg_m": 5000.0, "lead_s": 5.0}
BOX = {"kind": "box", "leg_m": 2000.0, "lead_s": 5.0}
GUSTY = {
    "wind_east_mps": 5.0,
    "shear": {"kind": "linear", "east_per_s": 0.01},
    "gusts": [{"at_s": 5.0, "duration_s": 4.0, "down_mps": 3.0}],
    "random_gusts": {"every_s": 10.0, "speed_mps": 3.0},
    "turbulence_severity": 2,
}


def plant(cessna: Aircraft, weather: Weather, alt_m: float = 3000.0, step_hz: int = 120) -> Plant:
    return Plant(cessna.facts, PlantSetup(0.3, 2.0, alt_m, 0.0, 75.0, WIND, step_hz=step_hz, weather=weather))


def wind(flying: Plant) -> list[float]:
    return [flying.value(f"wind_{axis}") for axis in ("north", "east", "down")]


def bump(time: np.ndarray, start: float, duration: float) -> np.ndarray:
    inside = (time > start) & (time < start + duration)
    return np.where(inside, 0.5 * (1.0 - np.cos(2.0 * np.pi * (time - start) / duration)), 0.0)


@pytest.mark.parametrize("grid", [0.0, 1.0])
@pytest.mark.parametrize("weather", [Weather(), Weather(gusts=(Gust(at_s=1.0, duration_s=2.0, down_mps=2.0),))])
def test_every_sum_of_the_air_has_two_terms(weather: Weather, grid: float) -> None:
    """JSBSim complains on stderr of a sum of one, as it did of gusts near the poles."""
    for total in ET.fromstring(weather_xml(weather, WIND, grid, 0.3)).iter("sum"):
        assert len(total) >= 2


@pytest.mark.parametrize("step_hz", [60, 240])
def test_gusts_have_their_form_at_every_rate_and_add_up(cessna: Aircraft, step_hz: int) -> None:
    first = Gust(at_s=1.013, duration_s=2.0, north_mps=5.0, east_mps=-3.0, down_mps=2.0)
    second = Gust(at_s=2.0, duration_s=3.0, north_mps=1.0)
    third = Gust(at_s=6.5, duration_s=0.5, east_mps=4.0)
    weather = Weather(gusts=(third, second, first))
    assert weather.slots == ((first, third), (second,))
    flying, schedule = plant(cessna, weather, step_hz=step_hz), GustSchedule(weather)
    schedule.begin(0.0, flying.clock_s)
    rows = []
    for step in range(8 * step_hz):
        if step % (step_hz // 10) == 0:
            for name, value in schedule.due(flying.time_s + 0.15):
                flying.command(name, value)
        flying.run(1)
        rows.append([flying.time_s, *wind(flying)])
    time, north, east, down = np.array(rows).T
    one, two, three = bump(time, 1.013, 2.0), bump(time, 2.0, 3.0), bump(time, 6.5, 0.5)
    np.testing.assert_allclose(north, WIND[0] + 5.0 * one + two, atol=1e-8)
    np.testing.assert_allclose(east, WIND[1] - 3.0 * one + 4.0 * three, atol=1e-8)
    np.testing.assert_allclose(down, 2.0 * one, atol=1e-8)
    assert one.max() > 0.999


def descend(flying: Plant, alt_m: float, target_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Heights and winds at every step of half a minute down."""
    flying.command("ap/height-ft", target_m / FT)
    rows = []
    for _ in range(120 * 30):
        flying.run(1)
        rows.append([flying.value("alt"), *wind(flying)])
    table = np.array(rows)
    assert table[-1, 0] < alt_m - 40.0
    # The wind of a step belongs to the height of the step before.
    return table[:-1, 0], table[1:, 1:]


def test_linear_shear_follows_the_height(cessna: Aircraft) -> None:
    weather = Weather(shear=LinearShear(north_per_s=0.02, east_per_s=-0.01), reference_m=3000.0)
    height, flown = descend(plant(cessna, weather), 3000.0, 2900.0)
    np.testing.assert_allclose(flown[:, 0], WIND[0] + 0.02 * (height - 3000.0), atol=1e-9)
    np.testing.assert_allclose(flown[:, 1], WIND[1] - 0.01 * (height - 3000.0), atol=1e-9)
    np.testing.assert_allclose(flown[:, 2], 0.0, atol=1e-12)


def test_logarithmic_shear_follows_the_height_above_ground_up_to_its_top(cessna: Aircraft) -> None:
    weather = Weather(shear=LogShear(roughness_m=0.05, top_m=230.0), reference_m=250.0)
    height, flown = descend(plant(cessna, weather, 250.0), 250.0, 150.0)
    profile = np.log(np.minimum(height, 230.0) / 0.05) / math.log(230.0 / 0.05)
    np.testing.assert_allclose(flown[:, 0], WIND[0] * profile, atol=1e-6)
    np.testing.assert_allclose(flown[:, 1], WIND[1] * profile, atol=1e-6)
    assert flown[0, 0] == pytest.approx(WIND[0], abs=1e-6)
    assert flown[-1, 0] < 0.99 * WIND[0]


def flown(aircraft: Aircraft, setup: PlantSetup, seconds: float, every: int = 12) -> np.ndarray:
    """Wind at every few steps, (n, 3)."""
    flying = Plant(aircraft.facts, setup)
    rows = round(seconds * setup.step_hz / every)
    return np.array([wind(flying) for _ in range(rows) if len(flying.run(every))])


def turbulent(strength: Strength, alt_m: float = 3000.0, **more: object) -> PlantSetup:
    return PlantSetup(0.3, 2.0, alt_m, 0.5, 75.0, weather=Weather(turbulence=strength, seed=3), **more)


@pytest.mark.parametrize("ground_m", [0.0, 1500.0])
def test_turbulence_follows_the_height_above_ground(cessna: Aircraft, ground_m: float) -> None:
    # MIL-F-8785C, figures 10 and 11: light turbulence, 15 kt at 20 ft.
    height_ft = 120.0 / FT
    shape = 0.177 + 0.000823 * height_ft
    vertical = 0.1 * 15.0 * 1852.0 / 3600.0
    level_m = height_ft / shape**1.2 * FT
    gust = flown(cessna, turbulent(Strength(3), 120.0 + ground_m, ground_m=ground_m), 900.0)[100:]
    # 67 km are 220 lengths of 300 m, 560 of 120 m.
    np.testing.assert_allclose(gust.std(axis=0), [vertical / shape**0.4] * 2 + [vertical], rtol=0.1)
    north, east = math.cos(0.5), math.sin(0.5)
    along, across = gust[:, 0] * north + gust[:, 1] * east, gust[:, 1] * north - gust[:, 0] * east
    distance = 7.5 * np.arange(1, 12)
    for values, length, transverse in ((along, level_m, 0.0), (across, level_m, 0.5), (gust[:, 2], 120.0, 0.5)):
        found = [np.mean(values[k:] * values[:-k]) / np.mean(values**2) for k in range(1, 12)]
        part = distance / length
        np.testing.assert_allclose(found, (1.0 - transverse * part) * np.exp(-part), atol=0.06)


@pytest.mark.parametrize("severity", [1, 2, 4, 6])
@pytest.mark.parametrize("alt_m", [100.0, 3000.0])
def test_every_severity_is_another_flight(cessna: Aircraft, severity: int, alt_m: float) -> None:
    weak, strong = (
        flown(cessna, turbulent(Strength(s), alt_m), 60.0)[100:].std(axis=0) for s in (severity, severity + 1)
    )
    assert weak.min() > 0.1
    assert (strong / weak).min() > 1.1


def test_a_strength_in_mps_is_flown(cessna: Aircraft) -> None:
    gust = flown(cessna, turbulent(Strength(vertical_mps=0.7), 120.0), 600.0)[100:]
    assert gust[:, 2].std() == pytest.approx(0.7, rel=0.08)


def test_turbulence_is_the_same_at_every_step_rate_and_has_no_steps(cessna: Aircraft) -> None:
    slow, fast = (flown(cessna, turbulent(Strength(3), step_hz=hz), 30.0, hz // 60) for hz in (60, 240))
    assert slow.std(axis=0).min() > 0.5
    np.testing.assert_allclose(slow, fast, atol=8e-3)
    # Straight from one thirtieth of a second to the next; the rows between the first and the second have begun.
    every = flown(cessna, turbulent(Strength(3), step_hz=240), 12.0, 1)[8:]
    bend = np.abs(np.diff(every, 2, axis=0)).max(axis=1)
    corners = np.zeros(len(bend), dtype=bool)
    corners[6::8] = True
    assert bend[~corners].max() < 1e-12
    assert np.median(bend[corners]) > 1e-3
    assert np.abs(np.diff(every, axis=0)).max() < 0.1


def gust_of(flight: Flight, wind_mps: tuple[float, float]) -> np.ndarray:
    """Gusts along and across the course through the steady wind, and down, in the first 20 s."""
    time = np.arange(0.0, 20.0, 0.1)
    gust, through = flight.wind_at(time) - [*wind_mps, 0.0], flight.carrier.at(time).velocity_n[:, :2] - wind_mps
    north, east = (through / np.linalg.norm(through, axis=1)[:, None]).T
    along, across = gust[:, 0] * north + gust[:, 1] * east, gust[:, 1] * north - gust[:, 0] * east
    return np.column_stack([along, across, gust[:, 2]])


def test_one_seed_has_the_same_gusts_on_every_course_and_in_every_wind(
    cessna: Aircraft, scenario_of: ScenarioOf
) -> None:
    flights = []
    for course, wind_mps in ((0.0, (0.0, 0.0)), (135.0, (0.0, 0.0)), (270.0, (0.0, 9.0)), (60.0, (0.0, -9.0))):
        air = {"turbulence_severity": 3, "wind_north_mps": wind_mps[0], "wind_east_mps": wind_mps[1]}
        scenario = scenario_of({"kind": "straight", "leg_m": 2000.0}, start={"heading_deg": course}, air=air)
        flights.append(gust_of(fly(scenario, cessna), wind_mps))
    assert flights[0].std(axis=0).min() > 0.5
    for other in flights[1:]:
        np.testing.assert_allclose(other, flights[0], atol=0.005)


def test_air_that_turns_takes_the_aircraft_along(cessna: Aircraft) -> None:
    def rate(axis: str, turning: float) -> float:
        setup = turbulent(Strength(1))
        fdm = start(cessna.facts, setup)
        fdm["ap/on"] = 0.0
        before = fdm[f"velocities/{axis}-rad_sec"]
        fdm[f"air/turbulence/{axis}-rad_sec"] = turning
        for _ in range(24):
            fdm.run()
        return fdm[f"velocities/{axis}-rad_sec"] - before

    for axis in "pqr":
        assert rate(axis, 0.05) - rate(axis, 0.0) > 0.003
    # Roll follows the air within its time constant of 0.25 s.
    assert rate("p", 0.05) - rate("p", 0.0) == pytest.approx(0.05 * (1.0 - math.exp(-0.2 / 0.25)), rel=0.2)


@pytest.mark.parametrize("alt_m", [160.0, 3000.0])
def test_light_air_rolls_the_aircraft_on_its_line(alt_m: float) -> None:
    assert 0.5 < roll_rms_deg(alt_m) < 1.5


def test_random_gusts_follow_the_settings() -> None:
    air = Air(random_gusts=RandomGusts(every_s=5.0, speed_mps=4.0, shortest_s=1.0, longest_s=3.0))
    gusts = drawn_gusts(air, 7, 20_000.0)
    assert gusts[: len(drawn_gusts(air, 7, 1000.0))] == drawn_gusts(air, 7, 1000.0)
    assert drawn_gusts(air, 8, 1000.0) != drawn_gusts(air, 7, 1000.0)
    starts, durations = np.array([g.at_s for g in gusts]), np.array([g.duration_s for g in gusts])
    vectors = np.array([[g.north_mps, g.east_mps, g.down_mps] for g in gusts])
    speeds = np.linalg.norm(vectors, axis=1)
    assert np.diff(starts).mean() == pytest.approx(5.0, rel=0.06)
    assert np.diff(starts).std() == pytest.approx(5.0, rel=0.1)
    assert durations.min() > 1.0
    assert durations.max() < 3.0
    assert durations.mean() == pytest.approx(2.0, rel=0.03)
    assert speeds.max() < 4.0
    assert speeds.mean() == pytest.approx(2.0, rel=0.04)
    np.testing.assert_allclose(vectors.mean(axis=0), 0.0, atol=0.08)
    np.testing.assert_allclose(vectors.var(axis=0), 16.0 / 9.0, rtol=0.1)


def digest(flight: Flight) -> str:
    carrier = flight.carrier
    arrays = [carrier.lat_rad, carrier.lon_rad, carrier.attitude, carrier.velocity_n, flight.wind_n]
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


CHILD = """
import sys
from magsim.aircraft import load_aircraft
from magsim.flight import fly
from magsim.flight.model.dryden import Strength
from magsim.scenario import Scenario
from tests.flight.model.test_weather import digest
cessna = load_aircraft("c208b")
print(digest(fly(Scenario.model_validate_json(sys.argv[1], context={"aircraft": cessna}), cessna)))
"""


def gusty_scenario(scenario_of: ScenarioOf, **tables: object) -> Scenario:
    """Return a scenario that is still valid when all its keys are written out."""
    return scenario_of(SHORT, air=GUSTY, recording={"valid_legs": []}, **tables)


@pytest.fixture(scope="module")
def gusty(cessna: Aircraft, scenario_of: ScenarioOf) -> Flight:
    return fly(gusty_scenario(scenario_of), cessna)


def test_another_process_flies_the_same_air(gusty: Flight, scenario_of: ScenarioOf) -> None:
    text = gusty_scenario(scenario_of).model_dump_json(by_alias=True)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", CHILD, text], check=True, capture_output=True, text=True, env=environment, cwd=ROOT
    )
    assert done.stdout.strip() == digest(gusty)


def test_another_sensor_does_not_change_the_wind_but_another_seed_does(
    gusty: Flight, cessna: Aircraft, scenario_of: ScenarioOf
) -> None:
    mounts = list(cessna.mounts)
    sensors = {
        "scalar": [{"name": "one", "mount": mounts[0]}, {"name": "two", "mount": mounts[-1]}],
        "fluxgate": [{"name": "flux", "mount": mounts[-1]}],
    }
    more = gusty_scenario(scenario_of).model_dump(by_alias=True) | {"sensors": sensors}
    assert digest(fly(Scenario.model_validate(more, context={"aircraft": cessna}), cessna)) == digest(gusty)
    other = fly(gusty_scenario(scenario_of, seed=2), cessna)
    count = min(len(other.wind_n), len(gusty.wind_n))
    assert np.abs(other.wind_n[:count] - gusty.wind_n[:count]).max() > 1.0


def test_the_recorded_wind_is_the_one_that_was_flown(cessna: Aircraft) -> None:
    # Motion over ground less wind is motion through the air: its length is JSBSim's airspeed.
    gust = Gust(at_s=1.0, duration_s=20.0, north_mps=6.0)
    flying = plant(cessna, Weather(turbulence=Strength(4), seed=5, gusts=(gust,)))
    for _ in range(100):
        flying.run(12)
        motion = np.array([flying.value(f"v_{axis}") for axis in ("north", "east", "down")])
        assert np.linalg.norm(motion - wind(flying)) == pytest.approx(flying.value("airspeed"), rel=1e-9)


def test_a_flight_meets_its_gust_on_time(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    air = {"wind_north_mps": 3.0, "gusts": [{"at_s": 7.0, "duration_s": 4.0, "east_mps": 5.0, "down_mps": -2.0}]}
    flight = fly(scenario_of(SHORT, air=air), cessna)
    time = np.arange(0.0, flight.duration_s, 0.1)
    flown = flight.wind_at(time)
    expected = np.column_stack([np.full_like(time, 3.0), 5.0 * bump(time, 7.0, 4.0), -2.0 * bump(time, 7.0, 4.0)])
    np.testing.assert_allclose(flown, expected, atol=1e-9)
    quiet = fly(scenario_of(SHORT, air={"wind_north_mps": 3.0}), cessna)
    roll = [np.degrees(one.carrier.at(np.array([10.0])).attitude[0, 0]) for one in (flight, quiet)]
    assert abs(roll[0] - roll[1]) > 0.5


def test_a_flight_through_shear_stays_on_its_legs(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    air = {"wind_east_mps": 10.0, "shear": {"kind": "log", "roughness_m": 0.6}}
    flight = fly(scenario_of(BOX, start={"alt_m": 200.0}, air=air), cessna)
    speed = 10.0 * np.log(flight.carrier.alt_m / 0.6) / math.log(200.0 / 0.6)
    np.testing.assert_allclose(flight.wind_n[:, 1], speed, atol=2e-3)
    assert flight.notes["closure_m"][0] < 30.0


def test_a_wind_that_blows_the_flight_off_is_reported(cessna: Aircraft, scenario_of: ScenarioOf) -> None:
    storm = {"gusts": [{"at_s": 2.0, "duration_s": 60.0, "east_mps": 70.0}]}
    with pytest.raises(DataError, match=r"the flight .* at t = \d+\.\d s: height \d+ m, airspeed"):
        fly(scenario_of({**SHORT, "leg_m": 5000.0}, air=storm), cessna)
