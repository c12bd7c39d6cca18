"""Candidate places for a sensor: in and around an aircraft, on two planes through it, and off its skin."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from magsim.aircraft import Vehicle
from magsim.errors import RequestError
from magsim.field import obstacles
from magsim.field.geometry import TriangleMesh, winding
from magsim.field.metal.steel import load_steel

MOST_PLACES = 20_000
"""Most places of one map."""

SKIN_PART = 0.3
"""Least distance of a candidate from the skin, in spacings: a mesh and a bracket need some."""

WIDEST = 0.25
"""Widest grid, in lengths of the aircraft."""

SHORTEST_M = 0.5
"""Least length of an aircraft: one described by few places may have none."""

REACH, BOOM, SPACING = 0.04, 0.30, 0.04
"""In lengths of the aircraft: how far off it a bracket reaches, how long a boom ahead or behind is, the grid."""


@dataclass(frozen=True)
class Extent:
    """The space that an aircraft fills.

    Attributes
    ----------
    points_m : (n, 3) [m]
        The vertices of its skin or outline; without one, its mounts and magnetic parts.
    skin : TriangleMesh, optional
    mounts_m : (k, 3) [m], optional
        Places that a picture has to hold.
    """

    points_m: np.ndarray
    skin: TriangleMesh | None = None
    mounts_m: np.ndarray | None = None

    @classmethod
    def of(cls, aircraft: Vehicle, skin: TriangleMesh | None) -> "Extent":
        """Return the body of an aircraft whose skin or outline, if it has one, is given."""
        mounts = np.array(list(aircraft.mounts.values()))
        if skin is not None:
            return cls(skin.vertices, skin, mounts)
        magnetics = aircraft.magnetics
        dipoles = [dipole.position_m for dipole in (*magnetics.permanent, *magnetics.hinged, *magnetics.controls)]
        steel = load_steel(aircraft).corners.reshape(-1, 3)
        return cls(np.concatenate([mounts, np.reshape(dipoles, (-1, 3)), steel]), None, mounts)

    @property
    def box(self) -> np.ndarray:
        """Least and greatest place along each axis, (2, 3) [m]."""
        return np.stack([self.points_m.min(axis=0), self.points_m.max(axis=0)])

    @property
    def length_m(self) -> float:
        """Extent along the forward axis [m], at least ``SHORTEST_M``."""
        return max(float(np.ptp(self.points_m[:, 0])), SHORTEST_M)

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Return whether points lie within a closed part of the skin, (p,) bool."""
        if self.skin is None:
            return np.zeros(len(points), dtype=bool)
        return winding(self.skin.vertices[self.skin.triangles], points) != 0

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the approximate distance from points to the aircraft, (p,) [m]."""
        known = [self.points_m]
        if self.skin is not None:
            known.append(self.skin.vertices[self.skin.triangles].mean(axis=1))
        return cKDTree(np.concatenate(known)).query(points)[0]


def free(aircraft: Vehicle, body: Extent, points: np.ndarray, spacing_m: float) -> np.ndarray:
    """Return whether a sensor can be at points, a part of a spacing away from the skin, (p,) bool."""
    clear = np.array([obstacle is None for obstacle in obstacles(aircraft, points)], dtype=bool)
    return clear & (body.distance(points) > SKIN_PART * spacing_m)


def grid(body: Extent, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places on a grid, within reach of the aircraft or on a boom ahead or behind.

    Parameters
    ----------
    body : Extent
    spacing_m : float [m]

    Returns
    -------
    points : (p, 3) [m]
    inside : (p,) bool

    Raises
    ------
    RequestError
        If there are too many, or hardly any.
    """
    if not 0.0 < spacing_m <= WIDEST * body.length_m:
        msg = (
            f"--spacing {spacing_m:g} is no distance on an aircraft of {body.length_m:.1f} m; allowed: above 0, up to "
            f"{WIDEST * body.length_m:.2g}"
        )
        raise RequestError(msg)
    reach, boom = REACH * body.length_m, BOOM * body.length_m
    low, high = body.box[0] - (boom, reach, reach), body.box[1] + (boom, reach, reach)
    if math.prod(side / spacing_m for side in (high - low).tolist()) > 50 * MOST_PLACES:
        raise _too_many(spacing_m, body)
    axes = [
        spacing_m * np.arange(np.ceil(a / spacing_m), np.floor(b / spacing_m) + 1)
        for a, b in zip(low, high, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    distance = body.distance(points)
    beyond = (points[:, 0] < body.box[0, 0]) | (points[:, 0] > body.box[1, 0])
    near = (distance < reach) | (
        beyond & (np.abs(points[:, 1]) < 0.5 * spacing_m) & (np.abs(points[:, 2]) < 3.0 * reach)
    )
    if body.skin is not None:
        wide = np.all((points > body.box[0]) & (points < body.box[1]), axis=1)
        near[wide & ~near] = body.inside(points[wide & ~near])
    points = points[near]
    if len(points) > MOST_PLACES:
        raise _too_many(spacing_m, body)
    return points, body.inside(points)


def _too_many(spacing_m: float, body: Extent) -> RequestError:
    msg = (
        f"--spacing {spacing_m:g} makes more than {MOST_PLACES} places around an aircraft of {body.length_m:.1f} m; "
        f"allowed: a wider one, such as {SPACING * body.length_m:.2g}"
    )
    return RequestError(msg)


def plane(body: Extent, spacing_m: float, normal: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a plane through the aircraft's datum.

    Parameters
    ----------
    body : Extent
    spacing_m : float [m]
    normal : int
        Number of the axis across the plane.

    Returns
    -------
    first, second : (m,), (n,) [m]
        Places along the two other axes.
    points : (m, n, 3) [m]
    """
    margin = np.array([BOOM, 2.0 * REACH, 2.0 * REACH]) * body.length_m
    low, high = body.box[0] - margin, body.box[1] + margin
    if body.mounts_m is not None:
        side = 2.0 * REACH * body.length_m
        low, high = (
            np.minimum(low, body.mounts_m.min(axis=0) - side),
            np.maximum(high, body.mounts_m.max(axis=0) + side),
        )
    others = [axis for axis in range(3) if axis != normal]
    sides = [np.arange(low[axis], high[axis] + spacing_m, spacing_m) for axis in others]
    points = np.full((len(sides[0]), len(sides[1]), 3), 0.0)
    points[..., others[0]], points[..., others[1]] = np.meshgrid(*sides, indexing="ij")
    return sides[0], sides[1], points
