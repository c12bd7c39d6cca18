"""Interpolation of an aircraft's gains around it, far enough off that they are those of a dipole to a good part.

Times the cube of the distance, such a gain hardly changes over the places where a bird swings: it is computed at few
nodes and interpolated in direction and inverse distance.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

CHUNK = 8192
"""Samples that are interpolated at once."""


class Around:
    """Coordinates in which a far field is nearly a constant: two directions and the inverse distance.

    Parameters
    ----------
    axes : (3, 3)
        Rows: two directions across, and the middle direction from the datum.
    low, high : (3,)
        Ranges of the coordinates.
    """

    def __init__(self, axes: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        self.axes, self.middle, self.half = axes, 0.5 * (low + high), 0.5 * (high - low)

    @classmethod
    def of(cls, places: np.ndarray) -> "Around":
        """Return the coordinates for places (n, s, 3) [m]."""
        flat = places.reshape(-1, 3)
        ahead = flat.mean(axis=0)
        ahead = ahead / np.linalg.norm(ahead)
        across = np.eye(3)[np.abs(ahead).argmin()]
        first = np.cross(ahead, across)
        first /= np.linalg.norm(first)
        axes = np.stack([first, np.cross(ahead, first), ahead])
        values, _ = _coordinates(axes, flat)
        low, high = values.min(axis=0), values.max(axis=0)
        room = 0.02 * (high - low) + 1e-6 * np.abs(high).max()
        return cls(axes, low - room, high + room)

    def fitted(self, respond: Callable[[np.ndarray], np.ndarray], degrees: tuple[int, int, int]) -> "Table":
        """Fit polynomials at nodes; ``respond`` returns gains (p, 3, c) at places (p, 3)."""
        knots = [np.cos(np.pi * (np.arange(d + 1) + 0.5) / (d + 1)) for d in degrees]
        scaled = np.stack(np.meshgrid(*knots, indexing="ij"), axis=-1).reshape(-1, 3)
        u, v, w = (self.middle + self.half * scaled).T
        ray = np.column_stack([u, v, np.ones_like(u)])
        ray *= (1.0 / (w * np.sqrt(np.einsum("pi,pi->p", ray, ray))))[:, None]
        values = respond(ray @ self.axes) / w[:, None, None] ** 3
        shape = tuple(d + 1 for d in degrees)
        table = values.reshape(*shape, -1)
        for axis, (count, knot) in enumerate(zip(shape, knots, strict=True)):
            inverse = np.linalg.inv(chebyshev.chebvander(knot, count - 1))
            table = np.moveaxis(np.tensordot(inverse, table, axes=(1, axis)), 0, axis)
        return Table(degrees, table.reshape(-1, *values.shape[1:]))

    def at(self, places: np.ndarray, table: "Table", strengths: np.ndarray) -> np.ndarray:
        """Return the field at places (n, s, 3) of sources of given strengths (n, c), (n, s, 3)."""
        out = np.empty_like(places)
        for first in range(0, len(places), CHUNK):
            rows = slice(first, first + CHUNK)
            for s in range(places.shape[1]):
                values, cubed = _coordinates(self.axes, places[rows, s])
                scaled = (values - self.middle) / self.half
                # summed over the sources first: one number for each axis and polynomial
                basis = chebyshev.chebvander3d(scaled[:, 0], scaled[:, 1], scaled[:, 2], table.degrees)
                strength = np.einsum("nc,mic->nmi", strengths[rows], table.values, optimize=True)
                out[rows, s] = np.einsum("nm,nmi->ni", basis, strength) * cubed[:, None]
        return out


@dataclass(frozen=True)
class Table:
    """Polynomials of gains in the coordinates of ``Around``.

    Attributes
    ----------
    degrees : tuple of int
        In the three coordinates.
    values : (m, 3, c)
        Coefficients of the ``m`` products of Chebyshev polynomials.
    """

    degrees: tuple[int, int, int]
    values: np.ndarray


def _coordinates(axes: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinates of places (n, 3), and the inverse cube of the distance from the datum."""
    first, second, ahead = (np.einsum("ni,i->n", places, axis) for axis in axes)
    inverse = 1.0 / np.sqrt(np.einsum("ni,ni->n", places, places))
    return np.column_stack([first / ahead, second / ahead, inverse]), inverse**3
