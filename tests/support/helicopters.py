"""Flights of the kinematic helicopter: places, patterns, and quantities of a flight."""

import math

import numpy as np

from magsim.aircraft import Aircraft, Bird
from magsim.earth import ecef_from_geodetic
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario
from magsim.trajectory import Flight, Trajectory

SPEED_MPS, HEIGHT_M = 28.0, 1250.0
WIND = {"wind_north_mps": 5.0, "wind_east_mps": -8.0}
STILL = {"sway": {"lateral_m": 0.0, "vertical_m": 0.0, "along_m": 0.0, "heading_deg": 0.0}}
BOX: dict = {"kind": "box", "leg_m": 600.0, "bank_deg": 12.0}
LINE = {"kind": "straight", "leg_m": 600.0}
PLACES = {
    "middle": (48.7, 127.2, 0.0),
    "date line": (10.0, 179.995, 90.0),
    "far north": (85.0, -30.0, 45.0),
    "at the north pole": (89.9, 10.0, 0.0),
    "at the south pole": (-89.95, 179.99, 200.0),
}
"""Latitude, longitude, first course."""


def scenario_of(helicopter: Aircraft, bird: Bird, pattern: dict, place: str = "middle", **tables: object) -> Scenario:
    """Make a scenario of a pattern and a place, without sway; other tables by keyword."""
    lat, lon, course = PLACES[place]
    start = {"lat_deg": lat, "lon_deg": lon, "heading_deg": course, "alt_m": HEIGHT_M, "speed_mps": SPEED_MPS}
    raw = {
        "schema": 1,
        "seed": 1,
        "aircraft": "helicopter",
        "start": start | tables.pop("start", {}),
        "pattern": pattern,
        "flight": STILL,
        "sensors": {"scalar": [{"name": "cabin", "mount": "cabin"}]},
    }
    return FlyableScenario.model_validate(raw | tables, context={"aircraft": helicopter, "bird": bird})


def places(path: Trajectory) -> np.ndarray:
    return ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)


def through_air(flight: Flight) -> np.ndarray:
    """Velocity through the air, north, east, down."""
    return flight.carrier.velocity_n - flight.wind_n


def angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return (first - second + math.pi) % (2.0 * math.pi) - math.pi
