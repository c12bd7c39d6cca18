"""The wind triangle: airspeed, course and wind to speed over ground and heading."""

import math

from magsim.storage.compiled import compiled


def ground_speed(speed_mps: float, course: float, wind_mps: tuple[float, float]) -> float:
    """Return the speed over ground [m/s] that an airspeed gives along a course [rad] in wind."""
    along, right = _wind_along(course, wind_mps)
    return along + math.sqrt(max(0.0, speed_mps**2 - right**2))


@compiled
def crab_heading(speed_mps: float, course: float, wind_mps: tuple[float, float]) -> float:
    """Return the heading [rad] that keeps a course in wind."""
    _, right = _wind_along(course, wind_mps)
    return course - math.asin(max(-1.0, min(1.0, right / speed_mps)))


@compiled
def _wind_along(course: float, wind_mps: tuple[float, float]) -> tuple[float, float]:
    """Return the wind along and to the right of a course [m/s]."""
    north, east = wind_mps
    sin, cos = math.sin(course), math.cos(course)
    return north * cos + east * sin, east * cos - north * sin
