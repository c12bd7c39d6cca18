"""Compiled loops along a trajectory."""

import numpy as np
from scipy.interpolate import PPoly

from magsim.storage.compiled import compiled


def values_on(curve: PPoly, time_s: np.ndarray, order: int = 0) -> np.ndarray:
    """Return a curve of polynomials or a derivative of it, (n, m): to the last bit what scipy's own call returns.

    Parameters
    ----------
    curve : PPoly
        With values (m,).
    time_s : (n,)
        Fast where they are in order.
    order : int
        Of the derivative.
    """
    out = np.zeros((len(time_s), curve.c.shape[2]))
    _values_on(curve.c, curve.x, time_s, order, out)
    return out


@compiled
def _values_on(curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray, order: int, out: np.ndarray) -> None:
    degree, width = len(curve) - 1, curve.shape[2]
    factors = np.ones(degree + 1)
    for power in range(order, degree + 1):
        for k in range(order):
            factors[power] *= power - k
    piece, last = 0, len(knots) - 2
    for n in range(len(time_s)):
        while piece < last and time_s[n] >= knots[piece + 1]:
            piece += 1
        while piece > 0 and time_s[n] < knots[piece]:
            piece -= 1
        s, z = time_s[n] - knots[piece], 1.0
        for power in range(order, degree + 1):
            for i in range(width):
                out[n, i] += curve[degree - power, piece, i] * z * factors[power]
            z *= s


def rotations_on(curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the inverse rotations of quaternions on a curve of polynomials, (n, 3, 3).

    Parameters
    ----------
    curve : (d + 1, k, 4)
        Coefficients of the pieces, the highest power first; scalar part first, of any length but 0.
    knots : (k + 1,)
    time_s : (n,)
    """
    out = np.empty((len(time_s), 3, 3))  # by numpy, which has it on large pages
    _rotations_on(curve, knots, time_s, out)
    return out


@compiled
def _rotations_on(curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray, out: np.ndarray) -> None:
    q = np.empty(4)
    piece, last = 0, len(knots) - 2
    for n in range(len(time_s)):
        while piece < last and time_s[n] >= knots[piece + 1]:
            piece += 1
        while piece > 0 and time_s[n] < knots[piece]:
            piece -= 1
        s = time_s[n] - knots[piece]
        for i in range(4):
            value = curve[0, piece, i]
            for power in range(1, len(curve)):
                value = value * s + curve[power, piece, i]
            q[i] = value
        w, x, y, z = q[0], q[1], q[2], q[3]
        twice = 2.0 / (w * w + x * x + y * y + z * z)
        out[n, 0, 0] = 1.0 - twice * (y * y + z * z)
        out[n, 1, 0] = twice * (x * y - w * z)
        out[n, 2, 0] = twice * (x * z + w * y)
        out[n, 0, 1] = twice * (x * y + w * z)
        out[n, 1, 1] = 1.0 - twice * (x * x + z * z)
        out[n, 2, 1] = twice * (y * z - w * x)
        out[n, 0, 2] = twice * (x * z - w * y)
        out[n, 1, 2] = twice * (y * z + w * x)
        out[n, 2, 2] = 1.0 - twice * (x * x + y * y)
