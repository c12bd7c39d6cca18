"""Magnetic bodies in the ground: dipoles, spheres, prisms, each with its known field.

A body is described in straight north-east-down axes at its own center. It is magnetized by the main field there at the
start of the flight, and by what it remembers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from magsim.earth import LocalFrame, decimal_year, igrf
from magsim.errors import DataError
from magsim.field.background.path import BodyPlaces, Bounds, Knots, along_path, knots_of, positions_along
from magsim.field.background.prism import prism_field
from magsim.field.situation import Passage
from magsim.field.sources.dipoles import SCALE, dipole_field
from magsim.scenario import DipoleTarget, GroundPoint, PrismTarget, Scenario, SphereTarget, Start, Target
from magsim.terrain import Ground, TangentPlane
from magsim.units import MU0, NT_PER_T

NEAREST_M = 0.5
"""A magnetometer nearer to a point dipole than this is inside of what the dipole stands for."""


@dataclass(frozen=True)
class Source:
    """A body with its field.

    Attributes
    ----------
    name : str
    frame : LocalFrame
        At its center.
    half_size : (3,) [m]
        Of the box that holds it, along its own axes.
    turn : (3, 3)
        From its own axes to north, east, down at its center.
    moment_am2 : (3,) [A m^2]
        Of the whole body, its own axes.
    kind : str
    """

    name: str
    frame: LocalFrame
    half_size: np.ndarray
    turn: np.ndarray
    moment_am2: np.ndarray
    kind: str

    def own(self, position_e: np.ndarray) -> np.ndarray:
        """Return the Earth-fixed positions in the body's own axes from its center, (..., 3) [m]."""
        return np.einsum("ij,...i->...j", self.turn, self.frame.place(position_e))

    def field_e(self, position_e: np.ndarray) -> np.ndarray:
        """Return the body's field at Earth-fixed positions, (n, 3) [nT] along Earth-fixed axes."""
        points = self.own(position_e)
        if self.kind == "prism":
            field = prism_field(self.half_size, self.moment_am2 / (8.0 * np.prod(self.half_size)), points)
        else:
            field = dipole_field(np.zeros(3), self.moment_am2, points)
        return self.frame.to_earth(np.einsum("ij,...j->...i", self.turn, field))

    def distance(self, position_e: np.ndarray) -> np.ndarray:
        """Return the distance [m] of Earth-fixed positions from the body's surface, (...); 0 or less inside."""
        points = self.own(position_e)
        if self.kind == "prism":
            beyond = np.abs(points) - self.half_size
            outside = np.maximum(beyond, 0.0)
            return np.sqrt(np.einsum("...i,...i->...", outside, outside)) + np.minimum(beyond.max(axis=-1), 0.0)
        return np.sqrt(np.einsum("...i,...i->...", points, points)) - self.half_size[0]

    def strongest_nt(self, distance_m: np.ndarray) -> np.ndarray:
        """Return a bound of the field [nT] at a distance from the surface."""
        moment = float(np.sqrt(np.sum(self.moment_am2**2)))
        far = 2.0 * SCALE * moment / np.maximum(distance_m, 1e-3) ** 3
        if self.kind == "prism":
            return np.minimum(far, MU0 * NT_PER_T * moment / (8.0 * np.prod(self.half_size)))
        return far


def geodetic_of(place: GroundPoint, start: Start) -> tuple[float, float]:
    """Return latitude and longitude of a place [rad]; those of the start point where it gives none."""
    if place.lat_deg is not None and place.lon_deg is not None:
        return math.radians(place.lat_deg), math.radians(place.lon_deg)
    plane = TangentPlane(math.radians(start.lat_deg), math.radians(start.lon_deg))
    lat, lon = plane.geodetic(np.array(place.north_m or 0.0), np.array(place.east_m or 0.0))
    return float(lat), float(lon)


def ground_height(ground: Ground | None, lat_rad: float, lon_rad: float) -> float:
    """Return the height of the ground above the ellipsoid [m]; 0 where a scenario has no ground."""
    return 0.0 if ground is None else float(ground.height(np.array(lat_rad), np.array(lon_rad)))


def source_of(target: Target, scenario: Scenario, ground: Ground | None) -> Source:
    """Return a target of a scenario as a source.

    A sphere's magnetization is ``chi H / (1 + chi / 3) + remanence`` (Jackson, Classical Electrodynamics, section
    5.11), a prism's ``chi H + remanence``, with H the main field at the center at the start of the flight.
    """
    lat, lon = geodetic_of(target, scenario.start)
    alt = ground_height(ground, lat, lon) - target.depth_m
    frame = LocalFrame(lat, lon, alt)
    turn = np.eye(3)
    if isinstance(target, DipoleTarget):
        return Source(target.name, frame, np.full(3, NEAREST_M), turn, np.array(target.moment_am2), "dipole")
    main_n = igrf(lat, lon, alt, decimal_year(scenario.start.time_utc))
    strength = main_n / (MU0 * NT_PER_T)
    chi, remanence = target.susceptibility, np.array(target.remanence_apm)
    if isinstance(target, SphereTarget):
        moment = (chi / (1.0 + chi / 3.0) * strength + remanence) * (4.0 / 3.0 * math.pi * target.radius_m**3)
        return Source(target.name, frame, np.full(3, target.radius_m), turn, moment, "sphere")
    assert isinstance(target, PrismTarget)
    cos, sin = math.cos(math.radians(target.heading_deg)), math.sin(math.radians(target.heading_deg))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    half_size = 0.5 * np.array([target.length_m, target.width_m, target.height_m])
    moment = np.einsum("ij,i->j", turn, chi * strength + remanence) * (8.0 * np.prod(half_size))
    return Source(target.name, frame, half_size, turn, moment, "prism")


def sources_of(scenario: Scenario, ground: Ground | None) -> tuple[Source, ...]:
    """Return all targets of a scenario as sources."""
    return tuple(source_of(target, scenario, ground) for target in scenario.field.targets)


def bounds_of(source: Source, arm_m: float) -> Bounds:
    """Return bounds of the derivatives of a body's field within an arm's length of a path.

    Along a line at distance d a dipole's field has derivatives below ``4 B / d`` and ``360 B / d^4``; that of a prism
    falls less steeply.
    """

    def bounds(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
        distance = np.maximum(source.distance(knots.center_e) - arm_m, 1.0)
        size = source.strongest_nt(distance)
        return 4.0 * size / distance, 360.0 * size / distance**4

    return bounds


def target(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the field of all targets in body axes, along each place's own path, (p, n, 3) [nT].

    Raises
    ------
    DataError
        If a place comes inside a body.
    """
    sources = sources_of(passage.scenario, passage.ground)

    @cache
    def knots(number: int, reach_m: float) -> np.ndarray:
        return knots_of(passage.path, reach_m, passage.time_s, bounds_of(sources[number], reach_m))

    def fields(places: BodyPlaces) -> np.ndarray:
        total = np.zeros((len(places.arms_b), len(passage.time_s), 3))
        for number, source in enumerate(sources):
            check_outside(source, passage, places)
            total += along_path(passage, places, knots(number, places.reach_m), source.field_e)
        return total

    return fields


def check_outside(source: Source, passage: Passage, places: BodyPlaces) -> None:
    """Refuse a flight that takes a magnetometer into a body."""
    center_e = passage.path.motion_e_at(passage.time_s)[0]
    near_s = passage.time_s[source.distance(center_e) <= places.reach_m]
    if not len(near_s):
        return
    inside = source.distance(positions_along(passage.path, places.arms_b, near_s)) <= 0.0
    if inside.any():
        row, column = np.argwhere(inside)[0]
        at = passage.path.at(near_s[[row]])
        msg = (
            f"field.targets: {places.names[column]} is inside the {source.kind} {source.name!r} at "
            f"{near_s[row]:.1f} s, at {math.degrees(at.lat_rad[0]):.6f}, {math.degrees(at.lon_rad[0]):.6f} deg, "
            f"{at.alt_m[0]:.1f} m above the ellipsoid; allowed: flights outside of every body"
        )
        raise DataError(msg)
