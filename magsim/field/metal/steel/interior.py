"""Homogeneous body given by its closed surface alone: from a potential on the surface to the flux through it.

The symmetric Dirichlet-to-Neumann operator of the Laplace equation inside (M. Costabel, in Boundary Elements IX,
Springer 1987; O. Steinbach, Numerical Approximation Methods for Elliptic Boundary Value Problems, Springer 2008,
section 6.6.3) takes the place of tetrahedra::

    S = D + (M/2 + K)^T V^-1 (M/2 + K)

``V`` and ``K`` are single and double layer, ``D`` is the hypersingular operator, which follows from ``V`` by the
surface curl, ``M`` the mass of a node in a triangle. ``u^T S u`` is the integral of ``|grad u|^2`` over the inside.
"""

import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from magsim.field.geometry.meshes import TriangleMesh
from magsim.field.geometry.panels import NEAR, RULE_3, RULE_7, RULE_28, TOUCHING, Panels, double_layer, hat_slopes


def interior_stiffness(surface: TriangleMesh, single: np.ndarray) -> np.ndarray:
    """Return the stiffness of a body of unit susceptibility on the nodes of its surface.

    Parameters
    ----------
    surface : TriangleMesh
        Closed and outward; several closed pieces and hollows are one body.
    single : (t, t) [m^3]
        ``mutual_potentials`` of its triangles.

    Returns
    -------
    (n, n) [m]
        Symmetric, positive semidefinite, zero for constants.
    """
    panels = Panels(surface.vertices[surface.triangles])
    flux = _flux(panels, surface)
    count, nodes = len(panels), len(surface.vertices)
    rows, columns = np.repeat(np.arange(count), 3), surface.triangles.ravel()
    out = flux.T @ cho_solve(cho_factor(single, lower=True), flux)
    curl = np.cross(panels.normals[:, None, :], hat_slopes(panels))
    for axis in range(3):
        turn = sparse.csr_array((curl[..., axis].ravel(), (rows, columns)), shape=(count, nodes))
        out += turn.T @ (turn.T @ single).T
    return 0.5 * (out + out.T)


def _flux(panels: Panels, surface: TriangleMesh) -> np.ndarray:
    """Return ``M/2 + K``, (t, n) [m^2]: far pairs by 3 x 3 points, near ones as in ``mutual_potentials``."""
    hats = _far(panels)
    longest = panels.lengths.max(axis=1)
    delta = cdist(panels.centroids, panels.centroids) / np.maximum.outer(longest, longest)
    for low, high, rule in ((0.0, TOUCHING, RULE_28), (TOUCHING, NEAR, RULE_7)):
        outer, inner = np.nonzero((delta >= low) & (delta < high))
        for start in range(0, len(outer), 4096):
            s, t = outer[start : start + 4096], inner[start : start + 4096]
            points = np.moveaxis(panels.take(s).points(rule[0]), 1, 0)
            values = np.einsum("q,qmj->mj", rule[1], double_layer(panels.take(t), points))
            hats[s, t] = np.where((s == t)[:, None], 0.0, panels.areas[s][:, None] * values)
    count = len(panels)
    out = np.zeros((count, len(surface.vertices)))
    for corner in range(3):
        gather = sparse.csr_array(
            (np.ones(count), (np.arange(count), surface.triangles[:, corner])), shape=(count, len(surface.vertices))
        )
        out += (gather.T @ hats[:, :, corner].T).T
    out /= 4.0 * np.pi
    # A constant drives no flux: M/2 + K applied to it is zero. What quadrature leaves goes to the triangle itself.
    own = -out.sum(axis=1) / 3.0
    np.add.at(out, (np.arange(count)[:, None], surface.triangles), own[:, None])
    return out


def _far(panels: Panels) -> np.ndarray:
    """Return 4 pi double layers of the hat functions by 3 x 3 points, (t, t, 3) [m^2]; near pairs are wrong."""
    points, count = panels.points(RULE_3[0]), len(panels)
    heights = np.einsum("tx,tx->t", panels.normals, panels.corners[:, 0])
    out = np.zeros((count, count, 3))
    step = max(1, 500_000 // (3 * count))
    for start in range(0, count, step):
        rows = points[start : start + step].reshape(-1, 3)
        above = np.einsum("px,tx->pt", rows, panels.normals) - heights
        for source, hats in enumerate(RULE_3[0]):
            dist = cdist(rows, points[:, source])
            dist[dist == 0.0] = np.inf
            seen = (above / dist**3).reshape(-1, 3, count).sum(axis=1)
            out[start : start + step] += seen[..., None] * hats
    return out * (np.multiply.outer(panels.areas, panels.areas) / 9.0)[..., None]
