"""Flat triangles with a constant source: exact integrals of 1/r and the matrix of mutual potentials.

Formulas: D. R. Wilton et al., IEEE Trans. Antennas Propag. 32, 276 (1984), for the potential; A. van Oosterom and
J. Strackee, IEEE Trans. Biomed. Eng. 30, 125 (1983), for the solid angle. Lengths in meters, no physical constants.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.distance import cdist

EDGE_FLOOR = 1e-14
"""Relative floor of the distance to an edge, on which the gradient is log-singular."""

NEAR, TOUCHING = 2.0, 1.2
"""Distance of two centroids over the longer edge below which the inner integral is exact, the outer rule composite."""

COINCIDENT = 1e-9
"""The same ratio below which two triangles count as one."""

RULE_3 = (np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0, np.full(3, 1.0 / 3.0))
"""Barycentric points and weights, degree 2."""


def _rule_7() -> tuple[np.ndarray, np.ndarray]:
    """Return the barycentric points and weights of the 7-point rule of degree 5 (J. Radon, 1948)."""
    root = np.sqrt(15.0)
    points, weights = [[1 / 3, 1 / 3, 1 / 3]], [9 / 40]
    for sign in (1.0, -1.0):
        b = (6.0 + sign * root) / 21.0
        a = 1.0 - 2.0 * b
        points += [[a, b, b], [b, a, b], [b, b, a]]
        weights += [(155.0 + sign * root) / 1200.0] * 3
    return np.array(points), np.array(weights)


def _composite(rule: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the same rule on each of the four triangles between corners and edge midpoints."""
    corners, half = np.eye(3), (np.eye(3) + np.roll(np.eye(3), 1, axis=1)) / 2.0
    parts = [
        np.array([corners[0], half[0], half[2]]),
        np.array([half[0], corners[1], half[1]]),
        np.array([half[2], half[1], corners[2]]),
        half,
    ]
    points = np.concatenate([np.einsum("qc,cb->qb", rule[0], part) for part in parts])
    return points, np.tile(rule[1] / 4.0, 4)


RULE_7 = _rule_7()
RULE_28 = _composite(RULE_7)


@dataclass(frozen=True)
class Panels:
    """Triangles in space.

    Attributes
    ----------
    corners : (t, 3, 3) [m]
        Corner points of each triangle; the normal follows the right-hand rule.
    """

    corners: np.ndarray

    def __len__(self) -> int:
        return len(self.corners)

    @cached_property
    def _edges(self) -> np.ndarray:
        return np.roll(self.corners, -1, axis=1) - self.corners

    @cached_property
    def lengths(self) -> np.ndarray:
        """Edge lengths, (t, 3) [m]; edge i runs from corner i to the next."""
        return np.linalg.norm(self._edges, axis=-1)

    @cached_property
    def _cross(self) -> np.ndarray:
        return np.cross(self._edges[:, 0], self._edges[:, 1])

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas, (t,) [m^2]."""
        return 0.5 * np.linalg.norm(self._cross, axis=-1)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals, (t, 3)."""
        return self._cross / (2.0 * self.areas[:, None])

    @cached_property
    def edge_normals(self) -> np.ndarray:
        """Outward unit normals of the edges in the plane, (t, 3, 3)."""
        return np.cross(self._edges / self.lengths[..., None], self.normals[:, None, :])

    @cached_property
    def centroids(self) -> np.ndarray:
        """Centroids, (t, 3) [m]."""
        return self.corners.mean(axis=1)

    def take(self, rows: np.ndarray) -> "Panels":
        """Return some of the triangles, in the given order, with the quantities already computed."""
        out = Panels(self.corners[rows])
        for name in ("lengths", "areas", "normals", "edge_normals"):
            out.__dict__[name] = getattr(self, name)[rows]
        return out

    def points(self, barycentric: np.ndarray) -> np.ndarray:
        """Return the points with the given barycentric coordinates (q, 3) on each triangle, (t, q, 3) [m]."""
        return np.einsum("qc,tcx->tqx", barycentric, self.corners)


@dataclass(frozen=True)
class _Seen:
    """What every integral needs: triangles seen from points, leading shape (p, t)."""

    rays: np.ndarray  # r_i, (p, t, 3, 3)
    dist: np.ndarray  # R_i, (p, t, 3)
    logs: np.ndarray  # f_i
    solid: np.ndarray  # (p, t)
    height: np.ndarray
    sums: np.ndarray  # S_i
    lengths: np.ndarray  # (t, 3)


def _see(panels: Panels, points: np.ndarray) -> _Seen:
    """Compute the quantities of triangles as seen from points of shape (p, t, 3) or (p, 1, 3)."""
    rays = points[..., None, :] - panels.corners
    dist = np.sqrt(np.einsum("...x,...x->...", rays, rays))
    following = np.roll(dist, -1, axis=-1)
    lengths = panels.lengths
    sums = dist + following
    logs = np.log((sums + lengths) / np.maximum(sums - lengths, EDGE_FLOOR * sums))
    dots = 0.5 * (dist**2 + following**2 - lengths**2)  # r_i . r_{i+1}
    height = np.einsum("...x,...x->...", rays[..., 0, :], panels.normals)
    below = (
        dist[..., 0] * dist[..., 1] * dist[..., 2]
        + dots[..., 0] * dist[..., 2]
        + dots[..., 2] * dist[..., 1]
        + dots[..., 1] * dist[..., 0]
    )
    solid = 2.0 * np.arctan2(2.0 * panels.areas * height, below)
    return _Seen(rays, dist, logs, solid, height, sums, lengths)


def _potential(panels: Panels, points: np.ndarray) -> np.ndarray:
    seen = _see(panels, points)
    reach = -np.einsum("...ix,...ix->...i", seen.rays, panels.edge_normals)
    return np.einsum("...i,...i->...", reach, seen.logs) - seen.height * seen.solid


def potential(panels: Panels, points: np.ndarray) -> np.ndarray:
    """Return the integrals of 1/r over each triangle.

    Parameters
    ----------
    panels : Panels
        ``t`` triangles.
    points : (p, 3) [m]

    Returns
    -------
    (p, t) [m]
    """
    return _potential(panels, np.asarray(points, dtype=float)[:, None, :])


def solid_angle(panels: Panels, points: np.ndarray) -> np.ndarray:
    """Return the solid angles of the triangles, (p, t); positive on the side of the normal."""
    return _see(panels, np.asarray(points, dtype=float)[:, None, :]).solid


def gradient(panels: Panels, points: np.ndarray) -> np.ndarray:
    """Return the gradients of ``potential`` with respect to the points, (p, t, 3)."""
    seen = _see(panels, np.asarray(points, dtype=float)[:, None, :])
    return -seen.solid[..., None] * panels.normals - np.einsum("...i,...ix->...x", seen.logs, panels.edge_normals)


def hat_slopes(panels: Panels) -> np.ndarray:
    """Return the slopes of the three linear functions that are 1 at one corner and 0 at the others, (t, 3, 3) [1/m]."""
    opposite = np.roll(panels.corners, -2, axis=1) - np.roll(panels.corners, -1, axis=1)
    return np.cross(panels.normals[:, None, :], opposite) / (2.0 * panels.areas[:, None, None])


def double_layer(panels: Panels, points: np.ndarray) -> np.ndarray:
    """Return the integrals of ``w_j n.(x - y) / |x - y|^3`` over each triangle, for the three hat functions ``w_j``.

    A hat function is its value under the point, times the solid angle, and a slope, times the integral of the ray.

    Parameters
    ----------
    panels : Panels
        ``t`` triangles.
    points : (p, 3) or (p, t, 3) [m]
        Not inside the triangle itself.

    Returns
    -------
    (p, t, 3)
        Together the solid angle, positive on the side of the normal.
    """
    points = np.asarray(points, dtype=float)
    points = points[:, None, :] if points.ndim == 2 else points
    seen, slopes = _see(panels, points), hat_slopes(panels)
    values = 1.0 / 3.0 + np.einsum("...tx,tjx->...tj", points - panels.centroids, slopes)
    rim = np.einsum("...ti,tix->...tx", seen.logs, panels.edge_normals)
    return values * seen.solid[..., None] - seen.height[..., None] * np.einsum("...tx,tjx->...tj", rim, slopes)


def hessian(panels: Panels, points: np.ndarray) -> np.ndarray:
    """Return second derivatives of ``potential``, (p, t, 3, 3) [1/m]; symmetric, free of trace off the triangle."""
    seen = _see(panels, np.asarray(points, dtype=float)[:, None, :])
    rays, dist = seen.rays, seen.dist
    turned = edge_turn(rays, np.roll(rays, -1, axis=-2))
    bent = rays / dist[..., None]
    bent = bent + np.roll(bent, -1, axis=-2)
    steep = 2.0 * seen.lengths / (seen.sums**2 - seen.lengths**2)
    return np.einsum("...j,...k->...jk", turned.sum(axis=-2), panels.normals) + np.einsum(
        "...i,...ij,...ik->...jk", steep, bent, panels.edge_normals
    )


def edge_turn(rays: np.ndarray, following: np.ndarray) -> np.ndarray:
    """Return the line integral of ``dl x r / r^3`` over straight edges, (..., 3) [1/m].

    Parameters
    ----------
    rays, following : (..., 3) [m]
        From the two ends of an edge to the point, in the edge's sense.
    """
    near, far = np.linalg.norm(rays, axis=-1), np.linalg.norm(following, axis=-1)
    dots = np.einsum("...x,...x->...", rays, following)
    kappa = (near + far) / (near * far * (near * far + dots))
    return kappa[..., None] * np.cross(rays, following)


def mutual_potentials(panels: Panels, *, chunk: int = 4096) -> np.ndarray:
    """Return the Galerkin matrix ``V[s, t]``, 1/(4 pi) of the double integral of 1/r over triangles s and t.

    Far pairs by 3 x 3 points; for near ones the inner integral is exact and the outer one has 7 points, or 28 for
    those that touch.

    Parameters
    ----------
    panels : Panels
        ``t`` triangles; no two may coincide.
    chunk : int
        Pairs that are worked on at a time.

    Returns
    -------
    (t, t) [m^3]
        Symmetric positive definite.

    Raises
    ------
    ValueError
        If two triangles have the same centroid.
    """
    areas = panels.areas
    longest = panels.lengths.max(axis=1)
    delta = cdist(panels.centroids, panels.centroids) / np.maximum.outer(longest, longest)
    if np.count_nonzero(delta < COINCIDENT) > len(panels):
        msg = "two charge surfaces coincide: bodies touch or overlap; leave a gap between them or merge their meshes"
        raise ValueError(msg)
    matrix = _far(panels)
    for low, high, rule in ((0.0, TOUCHING, RULE_28), (TOUCHING, NEAR, RULE_7)):
        outer, inner = np.nonzero((delta >= low) & (delta < high))
        for start in range(0, len(outer), chunk):
            s, t = outer[start : start + chunk], inner[start : start + chunk]
            points = np.moveaxis(panels.take(s).points(rule[0]), 1, 0)
            values = _potential(panels.take(t), points)
            matrix[s, t] = areas[s] * np.einsum("q,qm->m", rule[1], values)
    return (matrix + matrix.T) / (8.0 * np.pi)


def _far(panels: Panels) -> np.ndarray:
    """Return double integrals of 1/r by 3 x 3 points, (t, t) [m^3]; the diagonal is meaningless."""
    count = len(panels)
    points = panels.points(RULE_3[0]).reshape(-1, 3)
    out = np.empty((count, count))
    step = max(1, 2_000_000 // (9 * count))
    for start in range(0, count, step):
        dist = cdist(points[3 * start : 3 * (start + step)], points)
        dist[dist == 0.0] = np.inf
        out[start : start + step] = (1.0 / dist).reshape(-1, 3, count, 3).sum(axis=(1, 3))
    return out * np.multiply.outer(panels.areas, panels.areas) / 9.0
