"""The air of a flight: shear and gusts by formulas, turbulence after MIL-F-8785C, all of it recorded."""

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from magsim.aircraft import Aircraft
from magsim.errors import DataError
from magsim.flight import fly
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.weather import Weather, drawn_gusts
from magsim.flight.pilot.gusts import GustSchedule
from magsim.scenario import Air, Gust, LinearShear, LogShear, RandomGusts, Scenario
from magsim.trajectory import Flight
from magsim.units import FT
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


@pytest.mark.parametrize("model", ["tustin", "milspec"])
@pytest.mark.parametrize(("severity", "at_7500_ft", "at_15000_ft"), [(3, 6.7, 4.6), (5, 15.1, 11.6)])
def test_turbulence_has_the_strength_and_the_slope_of_the_specification(
    cessna: Aircraft, model: str, severity: int, at_7500_ft: float, at_15000_ft: float
) -> None:
    # MIL-F-8785C, figure 7, between its curves.
    flying = plant(cessna, Weather(severity=severity, model=model, seed=3), step_hz=60)
    rows = []
    for _ in range(30 * 600):
        flying.run(2)
        rows.append(wind(flying))
    gust = np.array(rows) - [*WIND, 0.0]
    height_ft = 3000.0 / FT
    sigma = FT * (at_7500_ft + (at_15000_ft - at_7500_ft) * (height_ft - 7500.0) / 7500.0)
    # 45 km are 84 lengths of 1750 ft: some 10 % of error in each axis.
    np.testing.assert_allclose(gust.std(axis=0), sigma, rtol=0.15)
    # A Dryden spectrum falls with the square of the frequency.
    frequency, density = welch(gust[:, 2], 30.0, nperseg=2048)
    level = [
        (density * frequency**2)[(frequency > low) & (frequency < high)].mean()
        for low, high in ((0.4, 1.0), (2.0, 5.0))
    ]
    assert level[1] == pytest.approx(level[0], rel=0.25)


def correlation(
    aircraft: Aircraft, weather: Weather, alt_m: float, seeds: range, seconds: int
) -> tuple[np.ndarray, np.ndarray]:
    """Covariances of turbulence along the path in still air, (n, 3), and the distances that they belong to [m].

    The mean is known to be 0: subtracting that of a record would remove correlation longer than the record.
    """
    found = []
    for seed in seeds:
        setup = PlantSetup(0.3, 2.0, alt_m, 0.0, 75.0, (0.0, 0.0), step_hz=60, weather=replace(weather, seed=seed))
        flying = Plant(aircraft.facts, setup)
        rows = np.array([wind(flying) for _ in range(12 * seconds) if flying.run(5)])
        count = len(rows)
        power = np.abs(np.fft.rfft(rows, 2 * count, axis=0)) ** 2
        lags = np.fft.irfft(power, axis=0)[:200]
        found.append(lags / (count - np.arange(len(lags)))[:, None])
    return np.mean(found, axis=0), 75.0 / 12.0 * np.arange(200)


def along(distance: np.ndarray, length: float) -> np.ndarray:
    """Correlation along the wind of a Dryden spectrum (MIL-F-8785C, 3.7.2.1), by its inverse Fourier transform."""
    return np.exp(-distance / length)


def across(distance: np.ndarray, length: float) -> np.ndarray:
    """The same across it."""
    return (1.0 - 0.5 * distance / length) * np.exp(-distance / length)


@pytest.mark.parametrize("model", ["tustin", "milspec"])
def test_turbulence_has_the_length_of_the_specification(cessna: Aircraft, model: str) -> None:
    covariance, distance = correlation(cessna, Weather(severity=3, model=model), 3000.0, range(1, 7), 500)
    length = 1750.0 * FT
    near = slice(1, 33)  # up to 200 m
    measured = covariance[near] / covariance[0]
    np.testing.assert_allclose(measured[:, 0], along(distance[near], length), atol=0.04)
    # The simpler model takes one pole for the two of the specification, at half the length.
    expected = across(distance[near], length) if model == "tustin" else along(distance[near], 0.5 * length)
    np.testing.assert_allclose(measured[:, 1:].mean(axis=1), expected, atol=0.04)


def test_turbulence_near_the_ground_has_the_lengths_and_strengths_there(cessna: Aircraft) -> None:
    height_ft = 100.0 / FT
    covariance, distance = correlation(cessna, Weather(severity=3), 100.0, range(1, 4), 400)
    # MIL-F-8785C, figures 10 and 11.
    level = 100.0 / (0.177 + 0.000823 * height_ft) ** 1.2
    strength = 0.1 * 7.7 / (0.177 + 0.000823 * height_ft) ** np.array([0.4, 0.4, 0.0])
    np.testing.assert_allclose(np.sqrt(covariance[0]), strength, rtol=0.06)
    near = slice(1, 17)
    measured = covariance[near] / covariance[0]
    np.testing.assert_allclose(measured[:, 0], along(distance[near], level), atol=0.04)
    np.testing.assert_allclose(measured[:, 1], across(distance[near], level), atol=0.04)
    np.testing.assert_allclose(measured[:, 2], across(distance[near], 100.0), atol=0.04)


def test_severity_1_acts_near_the_ground_and_depends_on_the_wind_there(cessna: Aircraft) -> None:
    def strength(wind_mps: float | None) -> float:
        flying = plant(cessna, Weather(severity=1, wind_20ft_mps=wind_mps, seed=3), alt_m=150.0)
        return float(np.std([wind(flying)[2] for _ in range(1200) if flying.run(12)]))

    calm, light, strong = strength(0.0), strength(None), strength(15.4)
    assert calm == pytest.approx(0.0, abs=1e-9)
    # Vertical turbulence below 1000 ft is 0.1 of the wind at 20 ft (MIL-F-8785C, 3.7.3.4).
    assert light == pytest.approx(0.77, rel=0.25)
    assert strong == pytest.approx(2.0 * light, rel=0.05)


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
    flying = plant(cessna, Weather(severity=4, seed=5, gusts=(Gust(at_s=1.0, duration_s=20.0, north_mps=6.0),)))
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
