"""Geometry of a path for the guidance, compiled: turns in their own coordinates, and points of tabulated elements."""

import math

import numpy as np

from magsim.storage.compiled import compiled

ELEMENT = np.dtype(
    [
        ("length_m", "f8"),
        ("north_m", "f8"),
        ("east_m", "f8"),
        ("course", "f8"),
        ("cos", "f8"),
        ("sin", "f8"),
        ("side", "f8"),
        ("radius_m", "f8"),
        ("ease_m", "f8"),
        ("angle", "f8"),
        ("first", "i8"),
        ("last", "i8"),
        ("turn", "?"),
    ]
)
"""An element of a path: its start and course, and of a turn its side (a straight has 0), shape, and rows of points.
``turn`` is that of its label: what lies between two legs may have straights."""


@compiled
def bend(along_m: float, length_m: float, ease_m: float, radius_m: float, angle: float) -> tuple[float, float]:
    """Return turned angle [rad] and curvature [1/m] at a distance along a turn to the right; straight outside."""
    from_end = along_m > length_m - ease_m
    near_m = length_m - along_m if from_end else along_m
    if near_m < ease_m:
        x = max(0.0, near_m / ease_m)
        turned, curvature = ease_m / radius_m * (x**3 - 0.5 * x**4), (3.0 * x**2 - 2.0 * x**3) / radius_m
        return (angle - turned, curvature) if from_end else (turned, curvature)
    return (along_m - 0.5 * ease_m) / radius_m, 1.0 / radius_m


@compiled
def turn_points(count: int, length_m: float, ease_m: float, radius_m: float, angle: float) -> np.ndarray:
    """Return points at equal distances along a turn, forward and right of its beginning, (count + 1, 2) [m].

    They are sums by Simpson's rule on the tangent.
    """
    step = length_m / count
    out = np.zeros((count + 1, 2))
    for i in range(count):
        a = bend(i * step, length_m, ease_m, radius_m, angle)[0]
        b = bend((i + 0.5) * step, length_m, ease_m, radius_m, angle)[0]
        c = bend((i + 1.0) * step, length_m, ease_m, radius_m, angle)[0]
        out[i + 1, 0] = out[i, 0] + step / 6.0 * (math.cos(a) + 4.0 * math.cos(b) + math.cos(c))
        out[i + 1, 1] = out[i, 1] + step / 6.0 * (math.sin(a) + 4.0 * math.sin(b) + math.sin(c))
    return out


@compiled
def turn_at(
    along_m: float, length_m: float, ease_m: float, radius_m: float, angle: float, points: np.ndarray
) -> tuple[float, float, float, float]:
    """Return forward [m], right [m], turned angle [rad] and curvature [1/m] at a distance from a turn's beginning.

    Parameters
    ----------
    along_m, length_m, ease_m, radius_m, angle : float
    points : (n, 2)
        From ``turn_points``; the tangents continue beyond both ends.
    """
    if along_m <= 0.0:
        return along_m, 0.0, 0.0, 0.0
    last = len(points) - 1
    if along_m >= length_m:
        beyond = along_m - length_m
        return points[last, 0] + beyond * math.cos(angle), points[last, 1] + beyond * math.sin(angle), angle, 0.0
    place = along_m / (length_m / last)
    i = min(int(place), last - 1)
    part = place - i
    turned, curvature = bend(along_m, length_m, ease_m, radius_m, angle)
    return (
        points[i, 0] + part * (points[i + 1, 0] - points[i, 0]),
        points[i, 1] + part * (points[i + 1, 1] - points[i, 1]),
        turned,
        curvature,
    )


@compiled
def point_at(elements: np.ndarray, points: np.ndarray, index: int, along_m: float) -> tuple[float, float, float, float]:
    """Return north [m], east [m], course [rad] and curvature [1/m] at a distance along an element of a path.

    Parameters
    ----------
    elements : (n,) of ELEMENT
    points : (m, 2) [m]
        Points of all turns.
    index : int
    along_m : float
        Straights and tangents continue beyond both ends.
    """
    e = elements[index]
    if e.side == 0.0:
        return e.north_m + along_m * e.cos, e.east_m + along_m * e.sin, e.course, 0.0
    forward, right, turned, curvature = turn_at(
        along_m, e.length_m, e.ease_m, e.radius_m, e.angle, points[e.first : e.last]
    )
    right *= e.side
    return (
        e.north_m + forward * e.cos - right * e.sin,
        e.east_m + forward * e.sin + right * e.cos,
        e.course + e.side * turned,
        e.side * curvature,
    )


@compiled
def curvature_at(elements: np.ndarray, index: int, along_m: float) -> float:
    """Return the curvature [1/m], positive to the right, at a distance along an element of a path."""
    e = elements[index]
    if e.side == 0.0:
        return 0.0
    return e.side * bend(along_m, e.length_m, e.ease_m, e.radius_m, e.angle)[1]
