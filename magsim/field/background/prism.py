"""The uniformly magnetized rectangular prism in closed form."""

import numpy as np

from magsim.field.sources.dipoles import SCALE

TINY_M = 1e-200
"""Stands for no distance."""


def _arctangent(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return ``arctan(y / x)``, also where x is zero."""
    return np.copysign(1.0, x) * np.arctan2(y, np.abs(x))


def _log(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return ``log(z + r)`` less the logarithm of the distance from the z axis, which is tiny on the axis."""
    return np.arcsinh(z / np.maximum(np.hypot(x, y), TINY_M))


def prism_field(half_size: np.ndarray, magnetization: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the flux density outside a rectangular prism.

    The second derivatives of the integral of 1/r over the prism, summed over its eight corners
    (Bhattacharyya 1964, Geophysics 29, 517). The logarithms are written as inverse hyperbolic sines: what that leaves
    out cancels between corners, and nothing is lost beside the edges' extensions.

    Parameters
    ----------
    half_size : (3,) [m]
        Half of the edges' lengths along x, y, z.
    magnetization : (3,) [A/m]
    points : (n, 3) [m]
        From the prism's center, along its edges; outside of it.

    Returns
    -------
    (n, 3) [nT]
    """
    half_size, magnetization = np.asarray(half_size, dtype=float), np.asarray(magnetization, dtype=float)
    points = np.asarray(points, dtype=float)
    out = np.zeros(points.shape)
    for number in range(8):
        sides = np.array([1.0 if number >> axis & 1 else -1.0 for axis in range(3)])
        x, y, z = (points - sides * half_size).T
        r = np.sqrt(x * x + y * y + z * z)
        xy, xz, yz = (_log(a, b, c) for a, b, c in ((x, y, z), (x, z, y), (y, z, x)))
        xx, yy, zz = (_arctangent(b * c, a * r) for a, b, c in ((x, y, z), (y, x, z), (z, x, y)))
        mx, my, mz = np.prod(sides) * magnetization
        out[:, 0] += xx * mx - xy * my - xz * mz
        out[:, 1] += yy * my - xy * mx - yz * mz
        out[:, 2] += zz * mz - xz * mx - yz * my
    return SCALE * out
