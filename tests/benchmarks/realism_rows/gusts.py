"""Gusts: each severity at each height, at heights above ground, and on every course.

``severity_growth_min``: standard deviation of the flown wind in units of that of the next weaker severity, the smallest
over severities and components, at 3000 m and 120 m above ground at sea level and on a plateau of 1500 m.
``low_heights_difference``: of the two low ones, the largest over severities and components.
``gust_spread_over_courses_mps``: one seed on 16 courses in still air and in wind from west, east and south; the largest
difference of a row's gust from the mean of all flights, along and across the course through the steady wind, and down.
``line_roll_rms_deg``: roll on a straight line in light air, as surveys and calibrations are shipped, at 3000 and 160 m.
"""

from collections.abc import Sequence

import numpy as np

from magsim.aircraft import Aircraft, load_aircraft
from magsim.flight import fly
from magsim.flight.model.dryden import Strength
from magsim.flight.model.plant import Plant
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.weather import Weather
from magsim.loading import load_scenario
from magsim.planning import FlyableScenario
from tests.benchmarks.rows import Row, at_least, at_most, within

SETTLED_S, SECONDS = 10.0, 180.0
PLACES = {"3000m": (3000.0, 0.0), "120m_sea": (120.0, 0.0), "120m_plateau": (1620.0, 1500.0)}
"""Height and that of the ground [m]."""

WINDS_MPS = ((0.0, 0.0), (0.0, 8.0), (0.0, -8.0), (8.0, 0.0))
"""To north and east."""

LINE = ("pattern.maneuvers=[]", "pattern.leg_m=20000")

COURSES_DEG = np.arange(16) * 22.5


def deviation(aircraft: Aircraft, strength: Strength, alt_m: float, ground_m: float) -> np.ndarray:
    """Standard deviation of the flown wind to north, east and down, (3,) [m/s]."""
    weather = Weather(turbulence=strength)
    plant = Plant(aircraft.facts, PlantSetup(0.3, 2.0, alt_m, 0.5, 75.0, ground_m=ground_m, weather=weather))
    rows = [[plant.value(f"wind_{axis}") for axis in ("north", "east", "down")] for _ in _tenths(plant)]
    return np.std(rows[round(SETTLED_S * 10.0) :], axis=0)


def _tenths(plant: Plant) -> Sequence[list[float]]:
    return (plant.run(12) for _ in range(round((SETTLED_S + SECONDS) * 10.0)))


def line_gusts(
    aircraft: Aircraft, course_deg: float, wind_mps: tuple[float, float], seconds: float, air: dict[str, float]
) -> np.ndarray:
    """Gusts along and across the course through the steady wind, and down, at the rows of a line, (n, 3) [m/s]."""
    scenario = FlyableScenario.model_validate(
        {
            "schema": 1,
            "seed": 5,
            "aircraft": aircraft.name,
            "start": {"lat_deg": 16.7, "lon_deg": 112.7, "alt_m": 1000.0, "speed_mps": 75.0, "heading_deg": course_deg},
            "pattern": {"kind": "straight", "leg_m": 85.0 * (seconds + 5.0)},
            "air": {"wind_north_mps": wind_mps[0], "wind_east_mps": wind_mps[1]} | air,
            "sensors": {"scalar": [{"name": "cabin", "mount": next(iter(aircraft.mounts))}]},
        },
        context={"aircraft": aircraft},
    )
    flight = fly(scenario, aircraft)
    time = np.arange(0.0, seconds, 0.1)
    gust_n = flight.wind_at(time) - [*wind_mps, 0.0]
    through = flight.carrier.at(time).velocity_n[:, :2] - wind_mps
    north, east = (through / np.linalg.norm(through, axis=1)[:, None]).T
    along, across = gust_n[:, 0] * north + gust_n[:, 1] * east, gust_n[:, 1] * north - gust_n[:, 0] * east
    return np.column_stack([along, across, gust_n[:, 2]])


def roll_rms_deg(alt_m: float) -> float:
    """Roll on a straight line in the calibration flight's air."""
    light = load_scenario("calibration_c208b").scenario.air.turbulence_mps
    loaded = load_scenario("patterns/straight", (*LINE, f"start.alt_m={alt_m}", f"air.turbulence_mps={light}"))
    flight = fly(loaded.scenario, loaded.aircraft)
    roll = flight.carrier.at(np.arange(0.0, flight.duration_s, 0.1)).attitude[:, 0]
    return float(np.degrees(roll.std()))


def spread(gusts: np.ndarray) -> float:
    """Largest difference from the mean over flights, (flights, n, 3)."""
    return float(np.abs(gusts - gusts.mean(axis=0)).max())


def rows() -> list[Row]:
    """Growth, heights and courses."""
    cessna = load_aircraft("c208b")
    strengths = {
        place: np.array([deviation(cessna, Strength(severity), *heights) for severity in range(1, 8)])
        for place, heights in PLACES.items()
    }
    growth = {place: float((found[1:] / found[:-1]).min()) for place, found in strengths.items()}
    low = np.abs(strengths["120m_plateau"] / strengths["120m_sea"] - 1.0).max()
    courses = [
        line_gusts(cessna, float(course), wind, 30.0, {"turbulence_severity": 3})
        for wind in WINDS_MPS
        for course in COURSES_DEG
    ]
    return [
        at_least("severity_growth_min", min(growth.values()), "1", 1.1),
        *(at_least(f"severity_growth_min_{place}", value, "1", 1.1) for place, value in growth.items()),
        at_most("low_heights_difference", float(low), "1", 0.1),
        at_most("gust_spread_over_courses_mps", spread(np.array(courses)), "m/s", 0.01),
        *(within(f"line_roll_rms_deg_{alt:g}m", roll_rms_deg(alt), "deg", 0.5, 1.5) for alt in (160.0, 3000.0)),
    ]
