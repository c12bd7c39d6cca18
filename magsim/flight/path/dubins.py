"""The shortest path from one point and course to another: a turn, a straight, a turn.

Dubins' paths of the kind turn-straight-turn, after a straight where that is shorter, with turns whose curvature is
eased in and out. The first turn's angle is the one unknown: the straight's direction follows from it, the second turn's
angle from that, and the offset across the straight must vanish.
"""

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import pairwise

from magsim.errors import RequestError
from magsim.flight.path.elements import Arc, Element, PathLabel, PathPoint, Straight, turn_shape

_NODES = 64
"""Intervals of Simpson's rule over the part of a turn in which the curvature rises: exact to a micrometer."""

_STEPS = 180
_FULL = 2.0 * math.pi

DubinsPath = tuple[float, int, float, float, int, float]
"""Length [m]; side and angle of the first turn; length of the straight; side and angle of the second turn."""


def connect(start: PathPoint, stop: PathPoint, radius_m: float, ease_m: float, label: PathLabel) -> tuple[Element, ...]:
    """Connect one point and course to another.

    Parameters
    ----------
    start, stop : PathPoint
    radius_m, ease_m : float
        Least radius of the turns, and the length over which their curvature rises.
    label : PathLabel
        Of every element.

    Raises
    ------
    RequestError
        If there is no such path; with straights of any length one always exists.
    """
    north, east = stop.north_m - start.north_m, stop.east_m - start.east_m
    cos, sin = math.cos(start.course), math.sin(start.course)
    ahead, right = north * cos + east * sin, east * cos - north * sin
    turned = (stop.course - start.course) % _FULL
    if min(turned, _FULL - turned) < 1e-9 and abs(right) < 1e-3 and ahead >= 0.0:
        return (Straight(label, start, ahead),) if ahead > 1e-3 else ()
    key = (round(ahead, 6), round(right, 6), round(turned, 12), radius_m, ease_m)
    way = _shortest(*key)
    if way is None:
        msg = f"no turns of {radius_m:.0f} m lead from one leg to the next, {math.hypot(north, east):.0f} m away"
        raise RequestError(msg)
    lead, (_, side, angle, length, other_side, other_angle) = way
    elements: list[Element] = []
    place = start
    for a_lead, a_side, a_angle, a_length in ((lead, side, angle, length), (0.0, other_side, other_angle, 0.0)):
        if a_lead > 0.0:
            elements.append(Straight(label, place, a_lead))
            place = elements[-1].at(a_lead)
        if a_angle > 0.0:
            radius = _radius(radius_m, ease_m, a_angle)
            elements.append(Arc(label, place, a_side, turn_shape(radius, ease_m, a_angle)))
            place = elements[-1].at(elements[-1].length_m)
        if a_length > 1e-3:
            elements.append(Straight(label, place, a_length))
            place = elements[-1].at(a_length)
    return tuple(elements)


@lru_cache(maxsize=256)
def _shortest(
    ahead: float, right: float, turned: float, radius_m: float, ease_m: float
) -> tuple[float, DubinsPath] | None:
    """Find the shortest path and the straight that is flown before it.

    To fly back in the opposite direction it is shorter to fly on a little, turn off and come round.
    """
    found = [
        (lead + way[0], lead, way)
        for lead in (0.5 * radius_m * i for i in range(7))
        for way in _paths(ahead - lead, right, turned, radius_m, ease_m)
    ]
    return min(found)[1:] if found else None


def _radius(radius_m: float, ease_m: float, angle: float) -> float:
    """Return the radius of a turn: small turns have less bank, so that their curvature can rise in time."""
    return max(radius_m, ease_m / (0.8 * angle))


def displacement(radius_m: float, ease_m: float, angle: float) -> tuple[float, float, float]:
    """Return forward and right [m] over a turn to the right, and its length [m]."""
    if angle <= 0.0:
        return 0.0, 0.0, 0.0
    radius = _radius(radius_m, ease_m, angle)
    ease = min(ease_m, 0.8 * radius * angle)
    forward, right = _rise(radius, ease)
    eased = 0.5 * ease / radius
    middle = angle - 2.0 * eased
    ahead, aside = radius * math.sin(middle), radius * (1.0 - math.cos(middle))
    # The end mirrors the beginning: seen along the last course it comes from the left of it.
    out = _turn(forward, -right, angle)
    bend = _turn(ahead, aside, eased)
    return forward + bend[0] + out[0], right + bend[1] + out[1], radius * angle + ease


@lru_cache(maxsize=4096)
def _rise(radius_m: float, ease_m: float) -> tuple[float, float]:
    """Return forward and right [m] while the curvature rises to 1/R."""
    forward = right = 0.0
    for node in range(_NODES + 1):
        x = node / _NODES
        weight = (1.0 if node in (0, _NODES) else 4.0 if node % 2 else 2.0) * ease_m / (3.0 * _NODES)
        turned = ease_m / radius_m * (x**3 - 0.5 * x**4)
        forward += weight * math.cos(turned)
        right += weight * math.sin(turned)
    return forward, right


def _turn(forward: float, right: float, angle: float) -> tuple[float, float]:
    """Turn a vector to the right."""
    cos, sin = math.cos(angle), math.sin(angle)
    return forward * cos - right * sin, forward * sin + right * cos


def _paths(ahead: float, right: float, turned: float, radius_m: float, ease_m: float) -> Iterator[DubinsPath]:
    """Yield every path to a point ahead and right, with the course there turned to the right."""
    for side in (1, -1):
        for other in (1, -1):

            def rest(angle: float, side: int = side, other: int = other) -> tuple[float, float, float, float]:
                """Return offsets across and along the straight, angle of the second turn, length of both turns."""
                course = side * angle
                second = (other * (turned - course)) % _FULL
                if second > _FULL - 1e-9:
                    second = 0.0
                f, r, length = displacement(radius_m, ease_m, angle)
                g, s, more = displacement(radius_m, ease_m, second)
                g, s = _turn(g, other * s, course)
                x, y = ahead - f - g, right - side * r - s
                return (
                    -x * math.sin(course) + y * math.cos(course),
                    x * math.cos(course) + y * math.sin(course),
                    second,
                    length + more,
                )

            angles = [0.0, *((i + 0.5) * _FULL / _STEPS for i in range(_STEPS))]
            if turned > 1e-9:
                # Where no second turn is needed its angle jumps by a full turn: test that angle too.
                angles.append(turned if side > 0 else _FULL - turned)
                angles.sort()
            across = [rest(angle)[0] for angle in angles]
            for i, (low, high) in enumerate(pairwise(angles)):
                found = _zero(lambda angle: rest(angle)[0], low, high, across[i], across[i + 1])
                if found is None:
                    continue
                off, straight, second, length = rest(found)
                if abs(off) < 1e-5 and straight >= 0.0:
                    yield length + straight, side, found, straight, other, second


def _zero(function: Callable[[float], float], low: float, high: float, at_low: float, at_high: float) -> float | None:
    """Find a zero between two angles by bisection, or None."""
    if abs(at_low) < 1e-7:
        return low
    if (at_low > 0.0) == (at_high > 0.0):
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        value = function(middle)
        if (value > 0.0) == (at_low > 0.0):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
