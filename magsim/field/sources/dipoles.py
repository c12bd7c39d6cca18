"""Permanent magnetism: point dipoles fixed in the aircraft, and dipoles that turn with a control surface."""

from dataclasses import dataclass

import numpy as np

from magsim.units import MU0, NT_PER_T

SCALE = MU0 / (4.0 * np.pi) * NT_PER_T
"""mu0 / 4 pi in nT m / A."""


def dipole_field(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Flux density of a point dipole (J. D. Jackson, Classical Electrodynamics, eq. 5.56).

    Parameters
    ----------
    position, moment : (..., 3) [m], [A m^2]
    points : (..., 3) [m]
        The three broadcast against each other.

    Returns
    -------
    (..., 3) [nT]
    """
    ray = np.asarray(points, dtype=float) - position
    dist = np.sqrt(np.einsum("...x,...x->...", ray, ray))[..., None]
    unit = ray / dist
    along = np.einsum("...x,...x->...", unit, np.asarray(moment, dtype=float))[..., None]
    return SCALE * (3.0 * along * unit - moment) / dist**3


def dipole_gradient(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Derivatives ``dB_i/dx_j`` of ``dipole_field``, (..., 3, 3) [nT/m]; symmetric and free of trace."""
    ray = np.asarray(points, dtype=float) - position
    moment = np.broadcast_to(np.asarray(moment, dtype=float), ray.shape)
    dist = np.sqrt(np.einsum("...x,...x->...", ray, ray))[..., None, None]
    along = np.einsum("...x,...x->...", ray, moment)[..., None, None]
    mixed = np.einsum("...i,...j->...ij", moment, ray)
    return (3.0 * SCALE) * (
        (mixed + np.swapaxes(mixed, -1, -2) + along * np.eye(3)) / dist**5
        - 5.0 * along * np.einsum("...i,...j->...ij", ray, ray) / dist**7
    )


@dataclass(frozen=True)
class HingedDipole:
    """A dipole that turns about a hinge.

    Attributes
    ----------
    position, moment : (3,) [m], [A m^2]
        With the surface at zero.
    hinge_point : (3,) [m]
    hinge_axis : (3,)
        Unit vector; positive deflection follows the right-hand rule.
    surface : str
        Control surface that carries it.
    name : str
    """

    position: np.ndarray
    moment: np.ndarray
    hinge_point: np.ndarray
    hinge_axis: np.ndarray
    surface: str
    name: str = ""


def _turned(axis: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Rows a0, a1, a2 with ``rotated vector = a0 + a1 cos + a2 sin`` (Rodrigues)."""
    fixed = axis * np.dot(axis, vector)
    return np.stack([fixed, vector - fixed, np.cross(axis, vector)])


def hinged_field(dipole: HingedDipole, cos: np.ndarray, sin: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Flux density at one point while the dipole turns.

    Both the moment and the ray are linear in (1, cos, sin) of the deflection, which makes this as cheap as a fixed
    dipole: with d from the hinge to the dipole and x from the hinge to the point, ``m.r = (Q m).x - m.d`` and
    ``r^2 = x^2 + d^2 - 2 x.(Q d)``.

    Parameters
    ----------
    dipole : HingedDipole
    cos, sin : (n,)
        Of the deflection.
    point : (3,) [m]

    Returns
    -------
    (n, 3) [nT]
    """
    arm, offset = dipole.position - dipole.hinge_point, point - dipole.hinge_point
    moment, lever = _turned(dipole.hinge_axis, dipole.moment), _turned(dipole.hinge_axis, arm)
    along = (moment * offset).sum(axis=1)
    along[0] -= np.dot(dipole.moment, arm)
    square = -2.0 * (lever * offset).sum(axis=1)
    square[0] += np.dot(offset, offset) + np.dot(arm, arm)
    inverse = 1.0 / (square[0] + square[1] * cos + square[2] * sin)
    cubed = SCALE * inverse * np.sqrt(inverse)
    radial = 3.0 * cubed * inverse * (along[0] + along[1] * cos + along[2] * sin)
    ray = -lever
    ray[0] += offset
    field = np.empty((len(cos), 3))
    for i in range(3):
        field[:, i] = radial * (ray[0, i] + ray[1, i] * cos + ray[2, i] * sin)
        field[:, i] -= cubed * (moment[0, i] + moment[1, i] * cos + moment[2, i] * sin)
    return field


def hinged_motion(dipole: HingedDipole, cos: np.ndarray, sin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] and moments [A m^2] of a dipole while it turns, (n, 3) each, from cosine and sine (n,)."""
    arm, moment = (_turned(dipole.hinge_axis, v) for v in (dipole.position - dipole.hinge_point, dipole.moment))
    terms = np.stack([np.ones_like(cos), cos, sin])
    return dipole.hinge_point + terms.T @ arm, terms.T @ moment
