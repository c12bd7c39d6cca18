"""Elements of a path: straights and turns.

A turn is an arc whose curvature is eased in and out, because a bank cannot be established at once; its tangent points
lie on the straights, so that a leg is straight over its whole length.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

from magsim.units import G0

TABLE_STEP_M = 1.0
"""Spacing of a turn's table: the chord leaves the arc by TABLE_STEP_M^2 / (8 R), 0.1 mm at 1 km."""


class PathLabel(NamedTuple):
    """Circuit, leg and part to which an element of a path belongs."""

    circuit: int
    leg: int
    turn: bool
    heading_deg: float
    """Planned course of the leg [deg]."""
    transit: bool = False
    """Whether it leads from one pattern to the next."""
    part: int = 0
    """Which pattern of the flight, from 0."""
    leg_index: int = 0
    """Number of the leg within its pattern, from 0."""


class PathPoint(NamedTuple):
    """A point of a path with its tangent and curvature (positive to the right)."""

    north_m: float
    east_m: float
    course: float
    curvature: float


class _Labeled:
    """Access to the label of an element."""

    label: PathLabel

    @property
    def circuit(self) -> int:
        """Number of the circuit, from 1."""
        return self.label.circuit

    @property
    def leg(self) -> int:
        """Number of the leg within its circuit, from 1."""
        return self.label.leg

    @property
    def turn(self) -> bool:
        """Whether it is flown between two legs."""
        return self.label.turn

    @property
    def heading_deg(self) -> float:
        """Planned course of the leg [deg]."""
        return self.label.heading_deg


@dataclass(frozen=True)
class Straight(_Labeled):
    """A straight from a point on a course [rad]."""

    label: PathLabel
    start: PathPoint
    length_m: float

    @cached_property
    def _tangent(self) -> tuple[float, float]:
        return math.cos(self.start.course), math.sin(self.start.course)

    def at(self, along_m: float) -> PathPoint:
        """Return the point at a distance from the beginning; the straight continues beyond both ends."""
        north, east, course, _ = self.start
        cos, sin = self._tangent
        return PathPoint(north + along_m * cos, east + along_m * sin, course, 0.0)

    def curvature(self, along_m: float) -> float:
        """Return 0: a straight has no curvature."""
        return 0.0


@dataclass(frozen=True)
class Arc(_Labeled):
    """A turn from a point on a course; ``side`` is 1 to the right, -1 to the left."""

    label: PathLabel
    start: PathPoint
    side: int
    shape: "TurnShape"

    @property
    def length_m(self) -> float:
        """Length along the turn [m]."""
        return self.shape.length_m

    def at(self, along_m: float) -> PathPoint:
        """Return the point at a distance from the beginning; the tangents continue beyond both ends."""
        forward, right, turned, curvature = self.shape.at(along_m)
        right, turned, curvature = self.side * right, self.side * turned, self.side * curvature
        sin, cos = math.sin(self.start.course), math.cos(self.start.course)
        return PathPoint(
            self.start.north_m + forward * cos - right * sin,
            self.start.east_m + forward * sin + right * cos,
            self.start.course + turned,
            curvature,
        )

    def curvature(self, along_m: float) -> float:
        """Return the curvature [1/m], positive to the right, at a distance from the beginning."""
        return self.side * self.shape.bend(along_m)[1]


Element = Straight | Arc


class TurnShape:
    """A turn to the right in its own coordinates: forward and right of its beginning.

    The curvature rises over ``ease_m`` by a cubic step, stays at 1/R, and falls likewise. The turned angle is
    ``(length - ease) / R``; the tangents at both ends of a quarter turn meet in a corner ``offset_m`` away.
    """

    def __init__(self, radius_m: float, ease_m: float, angle: float = 0.5 * math.pi) -> None:
        arc = angle * radius_m
        self.radius_m, self.angle = radius_m, angle
        self.ease_m = min(ease_m, 0.8 * arc)
        self.length_m = arc + self.ease_m
        count = max(8, round(self.length_m / TABLE_STEP_M))
        self._step = self.length_m / count
        self._table = self._integrate(count)
        self._end = math.cos(angle), math.sin(angle)
        self.offset_m = self._table[-1][0]

    def bend(self, along_m: float) -> tuple[float, float]:
        """Return turned angle [rad] and curvature [1/m] at a distance from the beginning; straight outside."""
        ease, radius, length = self.ease_m, self.radius_m, self.length_m
        if along_m < ease:
            x = max(0.0, along_m / ease)
            return ease / radius * (x**3 - 0.5 * x**4), (3.0 * x**2 - 2.0 * x**3) / radius
        if along_m > length - ease:
            turned, curvature = self.bend(length - along_m)
            return self.angle - turned, curvature
        return (along_m - 0.5 * ease) / radius, 1.0 / radius

    def _integrate(self, count: int) -> list[tuple[float, float]]:
        """Return points along the turn, by Simpson's rule on the tangent."""
        step, forward, right, out = self._step, 0.0, 0.0, [(0.0, 0.0)]
        for i in range(count):
            angles = [self.bend((i + part) * step)[0] for part in (0.0, 0.5, 1.0)]
            forward += step / 6.0 * (math.cos(angles[0]) + 4.0 * math.cos(angles[1]) + math.cos(angles[2]))
            right += step / 6.0 * (math.sin(angles[0]) + 4.0 * math.sin(angles[1]) + math.sin(angles[2]))
            out.append((forward, right))
        return out

    def at(self, along_m: float) -> tuple[float, float, float, float]:
        """Return forward [m], right [m], turned angle [rad] and curvature [1/m] at a distance from the beginning."""
        if along_m <= 0.0:
            return along_m, 0.0, 0.0, 0.0
        if along_m >= self.length_m:
            forward, right = self._table[-1]
            beyond, (cos, sin) = along_m - self.length_m, self._end
            return forward + beyond * cos, right + beyond * sin, self.angle, 0.0
        place = along_m / self._step
        index = min(int(place), len(self._table) - 2)
        part = place - index
        (f0, r0), (f1, r1) = self._table[index], self._table[index + 1]
        return f0 + part * (f1 - f0), r0 + part * (r1 - r0), *self.bend(along_m)


@lru_cache(maxsize=64)
def turn_shape(radius_m: float, ease_m: float, angle: float = 0.5 * math.pi) -> TurnShape:
    """Return a turn, integrated once."""
    return TurnShape(radius_m, ease_m, angle)


def turn_radius(speed_mps: float, bank_deg: float) -> float:
    """Return the radius [m] of a level coordinated turn, V^2 / (g tan(bank)), at a speed over ground."""
    return speed_mps**2 / (G0 * math.tan(math.radians(bank_deg)))


def length_of(elements: Sequence[Element]) -> float:
    """Return the length of a path [m]."""
    return math.fsum(element.length_m for element in elements)
