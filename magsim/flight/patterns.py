"""Patterns of legs and turns as a path in a plane that touches the ellipsoid at the start.

A path is a row of elements: straight legs and turns. A turn is an arc whose curvature is eased in and out, because a
bank cannot be taken up at once; its tangent points lie on the straights, so that a leg is straight over its whole
length.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from magsim.earth.wgs84 import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.errors import RequestError
from magsim.scenario import Box, Cloverleaf
from magsim.units import G0

TABLE_STEP_M = 1.0
"""Spacing of a turn's table: the chord leaves the arc by TABLE_STEP_M^2 / (8 R), 0.1 mm at 1 km."""


class LocalPlane:
    """Plane that touches a surface of constant height at a point: x north, y east there [m].

    A distance d from the point appears shorter by d^3 / (6 R^2): 0.7 m at 30 km, none at 10 km.
    """

    def __init__(self, lat_rad: float, lon_rad: float, alt_m: float) -> None:
        self.lat_rad, self.lon_rad, self.alt_m = lat_rad, lon_rad, alt_m
        self._origin = [float(v) for v in ecef_from_geodetic(lat_rad, lon_rad, alt_m)]
        rot_ne = rot_ne_at(lat_rad, lon_rad)
        self._north, self._east, self._down = ([float(v) for v in axis] for axis in rot_ne)

    def place(self, lat_rad: float, lon_rad: float) -> tuple[float, float]:
        """North and east [m] of a place at the plane's height."""
        return self.motion(lat_rad, lon_rad, 0.0, 0.0)[:2]

    def motion(self, lat_rad: float, lon_rad: float, north: float, east: float) -> tuple[float, float, float, float]:
        """Place [m] and horizontal velocity [m/s] in the plane from those on the ellipsoid."""
        sl, cl, so, co = math.sin(lat_rad), math.cos(lat_rad), math.sin(lon_rad), math.cos(lon_rad)
        normal = 6378137.0 / math.sqrt(1.0 - 6.69437999014e-3 * sl * sl)
        radius = (normal + self.alt_m) * cl
        ox, oy, oz = self._origin
        dx, dy = radius * co - ox, radius * so - oy
        dz = (normal * (1.0 - 6.69437999014e-3) + self.alt_m) * sl - oz
        vx, vy, vz = -north * sl * co - east * so, -north * sl * so + east * co, north * cl
        (nx, ny, nz), (ex, ey, ez) = self._north, self._east
        return (
            nx * dx + ny * dy + nz * dz,
            ex * dx + ey * dy + ez * dz,
            nx * vx + ny * vy + nz * vz,
            ex * vx + ey * vy + ez * vz,
        )

    def geodetic(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude [rad] of a place of the plane, at the plane's height.

        The place is where the perpendicular of the plane meets the surface of constant height; each pass moves along
        it by the height that is missing.
        """
        up = [-d for d in self._down]
        above = 0.0
        for _ in range(8):
            point = [
                o + north_m * n + east_m * e + above * u
                for o, n, e, u in zip(self._origin, self._north, self._east, up, strict=True)
            ]
            lat, lon, alt = (float(v) for v in geodetic_from_ecef(np.array(point)))
            above += self.alt_m - alt
        return lat, lon

    def north_at(self, lat_rad: float, lon_rad: float) -> float:
        """Direction of local north in the plane [rad], clockwise from the plane's north: none at its origin."""
        north, east = self.motion(lat_rad, lon_rad, 1.0, 0.0)[2:]
        return math.atan2(east, north)


class Place(NamedTuple):
    """A point of a path with its tangent and curvature (positive to the right)."""

    north_m: float
    east_m: float
    course: float
    curvature: float


@dataclass(frozen=True)
class Straight:
    """A straight from a point on a course [rad]."""

    circuit: int
    leg: int
    turn: bool
    heading_deg: float
    start: Place
    length_m: float

    @cached_property
    def _tangent(self) -> tuple[float, float]:
        return math.cos(self.start.course), math.sin(self.start.course)

    def at(self, along_m: float) -> Place:
        """The point at a distance from the beginning; before it and behind it the straight goes on."""
        north, east, course, _ = self.start
        cos, sin = self._tangent
        return Place(north + along_m * cos, east + along_m * sin, course, 0.0)

    def curvature(self, along_m: float) -> float:
        """None."""
        return 0.0


@dataclass(frozen=True)
class Arc:
    """A quarter turn from a point on a course; ``side`` is 1 to the right, -1 to the left."""

    circuit: int
    leg: int
    turn: bool
    heading_deg: float
    start: Place
    side: int
    shape: "TurnShape"

    @property
    def length_m(self) -> float:
        """Length along the turn [m]."""
        return self.shape.length_m

    def at(self, along_m: float) -> Place:
        """The point at a distance from the beginning; outside the turn its tangents go on."""
        forward, right, turned, curvature = self.shape.at(along_m)
        right, turned, curvature = self.side * right, self.side * turned, self.side * curvature
        sin, cos = math.sin(self.start.course), math.cos(self.start.course)
        return Place(
            self.start.north_m + forward * cos - right * sin,
            self.start.east_m + forward * sin + right * cos,
            self.start.course + turned,
            curvature,
        )

    def curvature(self, along_m: float) -> float:
        """Curvature [1/m], positive to the right, at a distance from the beginning."""
        return self.side * self.shape.bend(along_m)[1]


Element = Straight | Arc


class TurnShape:
    """A quarter turn to the right in its own coordinates: forward and right of its beginning.

    The curvature rises over ``ease_m`` by a cubic step, stays at 1/R, and falls likewise. The turned angle is
    ``(length - ease) / R``; the tangents at both ends meet in a corner ``offset_m`` away.
    """

    def __init__(self, radius_m: float, ease_m: float) -> None:
        quarter = 0.5 * math.pi * radius_m
        self.radius_m = radius_m
        self.ease_m = min(ease_m, 0.8 * quarter)
        self.length_m = quarter + self.ease_m
        count = max(8, round(self.length_m / TABLE_STEP_M))
        self._step = self.length_m / count
        self._table = self._integrate(count)
        self.offset_m = self._table[-1][0]

    def bend(self, along_m: float) -> tuple[float, float]:
        """Turned angle [rad] and curvature [1/m] at a distance from the beginning; straight outside."""
        ease, radius, length = self.ease_m, self.radius_m, self.length_m
        if along_m < ease:
            x = max(0.0, along_m / ease)
            return ease / radius * (x**3 - 0.5 * x**4), (3.0 * x**2 - 2.0 * x**3) / radius
        if along_m > length - ease:
            turned, curvature = self.bend(length - along_m)
            return 0.5 * math.pi - turned, curvature
        return (along_m - 0.5 * ease) / radius, 1.0 / radius

    def _integrate(self, count: int) -> list[tuple[float, float]]:
        """Points along the turn, by Simpson's rule on the tangent."""
        step, forward, right, out = self._step, 0.0, 0.0, [(0.0, 0.0)]
        for i in range(count):
            angles = [self.bend((i + part) * step)[0] for part in (0.0, 0.5, 1.0)]
            forward += step / 6.0 * (math.cos(angles[0]) + 4.0 * math.cos(angles[1]) + math.cos(angles[2]))
            right += step / 6.0 * (math.sin(angles[0]) + 4.0 * math.sin(angles[1]) + math.sin(angles[2]))
            out.append((forward, right))
        return out

    def at(self, along_m: float) -> tuple[float, float, float, float]:
        """Forward [m], right [m], turned angle [rad] and curvature [1/m] at a distance from the beginning."""
        if along_m <= 0.0:
            return along_m, 0.0, 0.0, 0.0
        if along_m >= self.length_m:
            forward, right = self._table[-1]
            return forward, right + along_m - self.length_m, 0.5 * math.pi, 0.0
        place = along_m / self._step
        index = min(int(place), len(self._table) - 2)
        part = place - index
        (f0, r0), (f1, r1) = self._table[index], self._table[index + 1]
        return f0 + part * (f1 - f0), r0 + part * (r1 - r0), *self.bend(along_m)


@lru_cache(maxsize=16)
def turn_shape(radius_m: float, ease_m: float) -> TurnShape:
    """A turn, integrated once."""
    return TurnShape(radius_m, ease_m)


def turn_radius(speed_mps: float, bank_deg: float) -> float:
    """Radius [m] of a level coordinated turn, V^2 / (g tan(bank)), at a speed over ground."""
    return speed_mps**2 / (G0 * math.tan(math.radians(bank_deg)))


class _Pen:
    """Draws a path element by element."""

    def __init__(self, start: Place, side: int, shape: TurnShape) -> None:
        self.place, self.side, self.shape = start, side, shape
        self.elements: list[Element] = []

    def straight(self, length_m: float, label: tuple[int, int, bool, float]) -> None:
        if length_m > 0.0:
            self._add(Straight(*label, self.place, length_m))

    def turn(self, label: tuple[int, int, bool, float]) -> None:
        self._add(Arc(*label, self.place, self.side, self.shape))

    def _add(self, element: Element) -> None:
        self.elements.append(element)
        self.place = element.at(element.length_m)


def _compass(degrees: float) -> float:
    """A heading in [0, 360) without the rounding of turned angles."""
    return round(degrees, 9) % 360.0


def path_of(
    pattern: Box | Cloverleaf, heading_deg: float, ground_speed_mps: float, ease_s: float
) -> tuple[Element, ...]:
    """Elements of a pattern around the plane's origin.

    Parameters
    ----------
    pattern : Box or Cloverleaf
    heading_deg : float
        Course of the first leg, clockwise from north.
    ground_speed_mps : float
        Largest speed over ground that any course will have: it sets the radius, so that no turn needs more than the
        planned bank.
    ease_s : float
        Time for a turn's bank to be taken up.

    Returns
    -------
    tuple of Element
        A box begins at the origin with its first leg and ends there with its last turn. A cloverleaf passes the
        origin in the middle of each of its four legs and ends with the last one.

    Raises
    ------
    RequestError
        If the turns do not fit into the leaves.
    """
    shape = turn_shape(turn_radius(ground_speed_mps, pattern.bank_deg), ground_speed_mps * ease_s)
    side = 1 if pattern.turn == "right" else -1
    course = math.radians(heading_deg)
    if isinstance(pattern, Box):
        pen = _Pen(Place(0.0, 0.0, course, 0.0), side, shape)
        for leg in range(4 * pattern.circuits):
            label = (leg // 4 + 1, leg % 4 + 1)
            heading = _compass(heading_deg + 90.0 * side * leg)
            pen.straight(pattern.leg_m, (*label, False, heading))
            pen.turn((*label, True, heading))
        return tuple(pen.elements)

    leaf = pattern.leaf_m
    if shape.offset_m > leaf:
        msg = (
            f"pattern.leaf_m: turns of {pattern.bank_deg:g} deg bank at {ground_speed_mps:.0f} m/s over ground take "
            f"{shape.offset_m:.0f} m, more than a leaf of {leaf:g} m; allowed: a leaf of at least {shape.offset_m:.0f} "
            "m, or more bank"
        )
        raise RequestError(msg)
    pen = _Pen(Place(-leaf * math.cos(course), -leaf * math.sin(course), course, 0.0), side, shape)
    for leg in range(4):
        heading = _compass(heading_deg + 270.0 * side * leg)
        pen.straight(2.0 * leaf, (1, leg + 1, False, heading))
        if leg < 3:
            _leaf(pen, leaf - shape.offset_m, (1, leg + 1, True, heading))
    return tuple(pen.elements)


def _leaf(pen: _Pen, side_m: float, label: tuple[int, int, bool, float]) -> None:
    """Three quarter turns and two straights: from the end of a pass to the beginning of the next."""
    pen.turn(label)
    for _ in range(2):
        pen.straight(side_m, label)
        pen.turn(label)


def length_of(elements: Sequence[Element]) -> float:
    """Length of a path [m]."""
    return math.fsum(element.length_m for element in elements)


POLE_M = 1000.0
"""Nearer to a pole, headings and longitudes turn too fast for the rates of log and field."""

POLAR_RAD = math.radians(80.0)


def check_pole(elements: Sequence[Element], plane: LocalPlane) -> None:
    """A path must keep its distance from the poles, where heading and longitude have no meaning.

    Raises
    ------
    RequestError
        If it does not.
    """
    if abs(plane.lat_rad) < POLAR_RAD:
        return
    north, east = plane.place(math.copysign(0.5 * math.pi, plane.lat_rad), 0.0)
    step = 0.1 * POLE_M
    nearest = math.inf
    for element in elements:
        for i in range(math.ceil(element.length_m / step) + 1):
            place = element.at(min(i * step, element.length_m))
            nearest = min(nearest, math.hypot(place.north_m - north, place.east_m - east))
    if nearest < POLE_M:
        msg = (
            f"start: the path comes within {nearest:.0f} m of the pole, where headings have no meaning; allowed: "
            f"{POLE_M:g} m or more"
        )
        raise RequestError(msg)
