"""Carriers on prescribed ways for the tests: parallels, meridians and circles, with an attitude of one's own."""

import math
from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft, load_aircraft, load_bird
from magsim.earth import ecef_from_geodetic, radii_of_curvature, rot_ne_at
from magsim.frames import rotate
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario
from magsim.terrain import TangentPlane
from magsim.trajectory import Flight, Segment, Trajectory
from tests.support.rotations import body_rates

LOG_HZ = 30
ALT_M = 1250.0


def carrier(
    time_s: np.ndarray, lat: np.ndarray, lon: np.ndarray, alt_m: np.ndarray, attitude: np.ndarray | None = None
) -> Trajectory:
    """A trajectory from places, with velocities and rates from splines; without an attitude level along the course."""
    velocity_e = CubicSpline(time_s, ecef_from_geodetic(lat, lon, alt_m))(time_s, 1)
    velocity_n = rotate(rot_ne_at(lat, lon), velocity_e)
    if attitude is None:
        course = np.unwrap(np.arctan2(velocity_n[:, 1], velocity_n[:, 0]))
        attitude = np.column_stack([np.zeros((len(time_s), 2)), course])
    rates = body_rates(attitude, CubicSpline(time_s, attitude)(time_s, 1))
    return Trajectory(time_s, lat, lon, alt_m, velocity_n, attitude, rates)


def times(seconds: float) -> np.ndarray:
    return np.arange(round(seconds * LOG_HZ) + 1) / LOG_HZ


def along_parallel(lat_deg: float, speed_mps: float, seconds: float = 20.0, alt_m: float = ALT_M) -> Trajectory:
    """East at a constant speed and height; west where it is negative."""
    time, lat = times(seconds), math.radians(lat_deg)
    radius = (radii_of_curvature(lat)[1] + alt_m) * math.cos(lat)
    one = np.ones(len(time))
    return carrier(time, lat * one, 0.3 + speed_mps / radius * time, alt_m * one)


def along_meridian(lat_deg: float, speed_mps: float, seconds: float = 20.0, alt_m: float = ALT_M) -> Trajectory:
    """North at a constant speed and height, past a latitude in the middle of the time; south where it is negative."""
    time, lat = times(seconds), math.radians(lat_deg)
    rate = speed_mps / (radii_of_curvature(lat)[0] + alt_m)
    one = np.ones(len(time))
    return carrier(time, lat + rate * (time - 0.5 * seconds), 0.3 * one, alt_m * one)


def circle(lat_deg: float, speed_mps: float, bank_deg: float, gravity: float, seconds: float = 60.0) -> Trajectory:
    """Turns to the right at a constant height and bank, coordinated on an Earth that does not turn."""
    time, bank = times(seconds), math.radians(bank_deg)
    radius = speed_mps**2 / (gravity * math.tan(bank))
    angle = speed_mps / radius * time
    plane = TangentPlane(math.radians(lat_deg), 0.3, ALT_M)
    lat, lon = plane.geodetic(radius * np.sin(angle), radius * (1.0 - np.cos(angle)))
    one = np.ones(len(time))
    return carrier(time, lat, lon, ALT_M * one, np.column_stack([bank * one, 0.0 * one, angle]))


def helicopter() -> Aircraft:
    return load_aircraft("helicopter")


def scenario(*, tow: dict | None = None, speed_mps: float = 28.0, **tables: object) -> Scenario:
    """A straight line of the kinematic helicopter with the shipped bird, without gusts."""
    raw = {
        "schema": 1,
        "seed": 1,
        "aircraft": "helicopter",
        "start": {"lat_deg": 30.0, "lon_deg": 17.0, "alt_m": ALT_M, "speed_mps": speed_mps},
        "pattern": {"kind": "straight", "leg_m": 1000.0},
        "tow": {"gusts": {"speed_mps": 0.0}, "settle_s": 0.0} | (tow or {}),
        "sensors": {"scalar": [{"name": "bird", "body": "bird", "mount": "nose"}]},
    }
    return FlyableScenario.model_validate(raw | tables, context={"aircraft": helicopter(), "bird": load_bird("bird")})


def flight_of(trajectory: Trajectory, wind_n: Callable[[np.ndarray], np.ndarray] | None = None) -> Flight:
    """A flight of a carrier, as one leg."""
    last = float(trajectory.time_s[-1])
    return Flight(
        carrier=trajectory,
        duration_s=last,
        simulation_rate_hz=120.0,
        controls={},
        segments=(Segment(1, 1, False, 0.0, 0.0, last, 0.0),),
        maneuvers=(),
        wind_n=None if wind_n is None else wind_n(trajectory.time_s),
    )
