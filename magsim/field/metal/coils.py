"""Closed polygons of wire: resistance, inductance, flux and field of the loops that stand for the skin."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from magsim.field.geometry.panels import edge_turn
from magsim.units import MU0

PIECES, ORDER = 16, 32
"""Pieces that each edge is cut into, and Gauss points on each piece: near fields of the wire are resolved."""


@dataclass(frozen=True)
class Loop:
    """A closed polygon of round wire.

    Attributes
    ----------
    vertices : (m, 3) [m]
        In the sense of positive current; the last joins the first.
    wire_radius_m : float
    """

    vertices: np.ndarray
    wire_radius_m: float

    @cached_property
    def edges(self) -> np.ndarray:
        """Edge vectors, (m, 3) [m]."""
        return np.roll(self.vertices, -1, axis=0) - self.vertices

    @cached_property
    def length_m(self) -> float:
        """Length of the wire [m]."""
        return float(np.linalg.norm(self.edges, axis=1).sum())

    @cached_property
    def area_vector(self) -> np.ndarray:
        """Flux through the loop for each component of a uniform field, (3,) [m^2]."""
        return 0.5 * np.cross(self.vertices, np.roll(self.vertices, -1, axis=0)).sum(axis=0)

    def field(self, points: np.ndarray) -> np.ndarray:
        """Return the flux density for a current of 1 A by the law of Biot and Savart, (p, 3) [T/A]."""
        rays = np.asarray(points, dtype=float)[:, None, :] - self.vertices
        return MU0 / (4.0 * np.pi) * edge_turn(rays, np.roll(rays, -1, axis=1)).sum(axis=1)


def inductance(first: Loop, second: Loop, *, pieces: int = PIECES, order: int = ORDER) -> float:
    """Return Neumann's integral over two loops [H], or over one loop twice.

    The inner integral over each edge is exact; the outer one is by Gauss-Legendre. For a loop with itself the
    distance is softened by the wire radius, which means surface current (C. R. Paul, Inductance, 2010, ch. 5).

    Parameters
    ----------
    first, second : Loop
        The same object for the self-inductance.
    pieces, order : int
        Pieces of each edge of ``first`` and Gauss points on each.
    """
    soft = first.wire_radius_m if first is second else 0.0
    node, weight = np.polynomial.legendre.leggauss(order)
    at = ((np.arange(pieces)[:, None] + 0.5 * (node + 1.0)) / pieces).ravel()
    weight = np.tile(0.5 * weight / pieces, pieces)
    on = first.vertices[:, None, :] + at[:, None] * first.edges[:, None, :]  # (m, q, 3)
    ends = np.sqrt(((on[:, :, None, :] - second.vertices) ** 2).sum(axis=-1) + soft**2)  # (m, q, k)
    sums, span = ends + np.roll(ends, -1, axis=-1), np.linalg.norm(second.edges, axis=1)
    logs = np.einsum("q,mqk->mk", weight, np.log((sums + span) / (sums - span)))
    cosine = np.einsum("mx,kx->mk", first.edges, second.edges) / span
    return float(MU0 / (4.0 * np.pi) * (cosine * logs).sum())


def inductance_matrix(loops: Sequence[Loop]) -> np.ndarray:
    """Return the self and mutual inductances, (c, c) [H]; symmetric."""
    matrix = np.empty((len(loops), len(loops)))
    for i, first in enumerate(loops):
        for j in range(i, len(loops)):
            matrix[i, j] = matrix[j, i] = inductance(first, loops[j])
    return matrix
