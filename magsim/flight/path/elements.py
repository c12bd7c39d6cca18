"""Elements of a path: straights and turns.

A turn is an arc whose curvature is eased in and out, because a bank cannot be established at once; its tangent points
lie on the straights, so that a leg is straight over its whole length.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from magsim.flight.path import turns
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
        self.points = turns.turn_points(count, self.length_m, self.ease_m, radius_m, angle)
        self.offset_m = float(self.points[-1, 0])

    def bend(self, along_m: float) -> tuple[float, float]:
        """Return turned angle [rad] and curvature [1/m] at a distance from the beginning; straight outside."""
        return turns.bend(along_m, self.length_m, self.ease_m, self.radius_m, self.angle)

    def at(self, along_m: float) -> tuple[float, float, float, float]:
        """Return forward [m], right [m], turned angle [rad] and curvature [1/m] at a distance from the beginning."""
        return turns.turn_at(along_m, self.length_m, self.ease_m, self.radius_m, self.angle, self.points)


@lru_cache(maxsize=64)
def turn_shape(radius_m: float, ease_m: float, angle: float = 0.5 * math.pi) -> TurnShape:
    """Return a turn, integrated once."""
    return TurnShape(radius_m, ease_m, angle)


def tables_of(path: Sequence[Element]) -> tuple[np.ndarray, np.ndarray]:
    """Return a path as the compiled guidance takes it: elements (n,) of ``turns.ELEMENT``, points of all turns (m, 2).

    The points of a shape that several turns have are there once.
    """
    elements, points = np.zeros(len(path), turns.ELEMENT), [np.empty((0, 2))]
    first_of: dict[int, int] = {}
    for row, element in zip(elements, path, strict=True):
        north, east, course, _ = element.start
        row["length_m"], row["north_m"], row["east_m"], row["course"] = element.length_m, north, east, course
        row["cos"], row["sin"], row["turn"] = math.cos(course), math.sin(course), element.turn
        if isinstance(element, Straight):
            continue
        shape = element.shape
        if id(shape) not in first_of:
            first_of[id(shape)] = sum(map(len, points))
            points.append(shape.points)
        first = first_of[id(shape)]
        row["side"], row["radius_m"], row["ease_m"] = element.side, shape.radius_m, shape.ease_m
        row["angle"], row["first"], row["last"] = shape.angle, first, first + len(shape.points)
    return elements, np.concatenate(points)


def turn_radius(speed_mps: float, bank_deg: float) -> float:
    """Return the radius [m] of a level coordinated turn, V^2 / (g tan(bank)), at a speed over ground."""
    return speed_mps**2 / (G0 * math.tan(math.radians(bank_deg)))


def length_of(elements: Sequence[Element]) -> float:
    """Return the length of a path [m]."""
    return math.fsum(element.length_m for element in elements)
