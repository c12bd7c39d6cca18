"""Spherical-harmonic fields and their gradients by irregular solid harmonics in Earth-fixed axes.

The harmonics follow Cunningham's recursion (Celestial Mechanics 2, 207, 1970): no singularity at the poles. Field and
gradient are contractions with coefficients that are differentiated once, in advance. Any set of Gauss coefficients
can be used, linear in time within one interval.

With position (x, y, z) = X / a, rho = 1 / (x^2 + y^2 + z^2), w = (x + iy) rho, zeta = z rho, the harmonics
``I[n, m] = (a / r)^(n+1) P_n^m(cos theta) exp(i m phi)`` (unnormalized, without the Condon-Shortley sign) obey

    I[0, 0] = sqrt(rho);  I[m, m] = (2m - 1) w I[m-1, m-1]
    I[n, m] = ((2n - 1) zeta I[n-1, m] - (n + m - 1) rho I[n-2, m]) / (n - m)
"""

import math
from functools import lru_cache

import numpy as np

from magsim.threads import one_blas_thread

REFERENCE_RADIUS_M = 6371.2e3
"""Geomagnetic reference radius ``a`` of IGRF and WMM [m]."""

CHUNK = 512
"""Points that are evaluated together: their harmonics stay in the processor's cache."""

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Independent entries of the symmetric gradient."""


def index(n: int, m: int) -> int:
    """Return the place of degree ``n`` and order ``m`` in a flat table."""
    return n * (n + 1) // 2 + m


def complex_coefficients(g: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Return the coefficients of the unnormalized harmonics from Schmidt semi-normalized Gauss coefficients.

    Parameters
    ----------
    g, h : (k,) [nT]
        Flat tables by ``index``, from degree 0 (which is zero) to the model's degree.

    Returns
    -------
    (k,) complex [nT]
        ``c`` with potential ``V = a Re sum c I``.
    """
    degree = degree_of(len(g))
    scale = [
        math.sqrt((1 if m == 0 else 2) * math.factorial(n - m) / math.factorial(n + m))
        for n in range(degree + 1)
        for m in range(n + 1)
    ]
    return np.array(scale) * (np.asarray(g) - 1j * np.asarray(h))


def degree_of(size: int) -> int:
    """Return the degree of a flat table with that many entries."""
    return (math.isqrt(8 * size + 1) - 3) // 2


def differentiate(c: np.ndarray) -> np.ndarray:
    """Return the coefficients of the three derivatives of ``Re sum c I`` by the dimensionless coordinates.

    Parameters
    ----------
    c : (k,) complex
        Flat table of degree N.

    Returns
    -------
    (3, k') complex
        Flat tables of degree N + 1, for d/dx, d/dy, d/dz.
    """
    degree = degree_of(len(c))
    out = np.zeros((3, index(degree + 2, 0)), dtype=complex)
    for n in range(degree + 1):
        for m in range(n + 1):
            value = c[index(n, m)]
            up = index(n + 1, m + 1)
            if m == 0:
                out[0, up] -= value.real
                out[1, up] += 1j * value.real
            else:
                down, factor = index(n + 1, m - 1), (n - m + 2) * (n - m + 1)
                out[0, up] -= value / 2
                out[0, down] += factor * value / 2
                out[1, up] += 1j * value / 2
                out[1, down] += 1j * factor * value / 2
            out[2, index(n + 1, m)] -= (n - m + 1) * value
    # I[n, 0] is real, so the imaginary part of its coefficient has no effect; it must not reach the next derivative.
    zonal = [index(n, 0) for n in range(degree + 2)]
    out[:, zonal] = out[:, zonal].real
    return out


def contraction(c: np.ndarray, *, gradient: bool) -> np.ndarray:
    """Return the rows that turn harmonics into the field and, on demand, its gradient.

    Parameters
    ----------
    c : (k,) complex [nT]
        From ``complex_coefficients``, degree N.
    gradient : bool

    Returns
    -------
    (3, 2 k') [nT] or (9, 2 k') [nT] and [nT/m]
        Field along x, y, z; then the gradient's entries in the order of ``PAIRS``. Columns: real part, then
        imaginary part of each harmonic, up to degree N + 1, or N + 2 with the gradient.
    """
    first = differentiate(c)
    rows = list(-first)
    if gradient:
        second = [differentiate(row) for row in first]
        rows = [np.pad(row, (0, second[0].shape[1] - len(row))) for row in rows]
        rows += [-second[j][k] / REFERENCE_RADIUS_M for j, k in PAIRS]
    table = np.array(rows)
    return np.stack([table.real, -table.imag], axis=-1).reshape(len(table), -1)


@lru_cache(maxsize=8)
def _recursion(degree: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the factors of zeta I[n-1, m] and rho I[n-2, m] for each degree, m = 0..n-2, each (n-1, 1, 1)."""
    ahead, back = [], []
    for n in range(degree + 1):
        m = np.arange(max(n - 1, 0))
        ahead.append(((2 * n - 1) / (n - m))[:, None, None])
        back.append(((n + m - 1) / (n - m))[:, None, None])
    return ahead, back


def harmonics(position_e: np.ndarray, degree: int) -> np.ndarray:
    """Return irregular solid harmonics at points.

    Parameters
    ----------
    position_e : (n, 3) [m]
        Earth-fixed positions, not the center.
    degree : int
        Highest degree, 1 or more.

    Returns
    -------
    (k, 2, n)
        Real and imaginary part of each harmonic, ordered by ``index``.
    """
    x, y, z = np.asarray(position_e, dtype=float).T / REFERENCE_RADIUS_M
    rho = 1.0 / (x * x + y * y + z * z)
    wr, wi, zeta = x * rho, y * rho, z * rho
    ahead, back = _recursion(degree)
    out = np.empty((index(degree + 1, 0), 2, len(x)))
    out[0, 0], out[0, 1] = np.sqrt(rho), 0.0
    for n in range(1, degree + 1):
        row, above, above2 = index(n, 0), index(n - 1, 0), index(n - 2, 0)
        corner = out[above + n - 1]
        if n > 1:
            block = out[row : row + n - 1]
            np.multiply(out[above : above + n - 1], ahead[n] * zeta, out=block)
            block -= (back[n] * rho) * out[above2 : above2 + n - 1]
        np.multiply((2 * n - 1) * zeta, corner, out=out[row + n - 1])
        out[row + n, 0] = (2 * n - 1) * (wr * corner[0] - wi * corner[1])
        out[row + n, 1] = (2 * n - 1) * (wr * corner[1] + wi * corner[0])
    return out


def evaluate(position_e: np.ndarray, base: np.ndarray, rate: np.ndarray, elapsed: np.ndarray) -> np.ndarray:
    """Return the field, and the gradient if the rows include it, at points with a time each.

    Parameters
    ----------
    position_e : (n, 3) [m]
        Earth-fixed positions.
    base, rate : (r, 2 k)
        Rows from ``contraction`` at the start of the interval, and their change per unit of ``elapsed``.
    elapsed : (n,)
        Time since the start of the interval, a year if the rate is per year.

    Returns
    -------
    (n, r)
        In the order of ``contraction``, Earth-fixed axes.
    """
    size = len(base)
    table = np.concatenate([base, rate])
    degree = degree_of(table.shape[1] // 2)
    out = np.empty((len(position_e), size))
    with one_blas_thread():  # the same bits on any number of threads
        for start in range(0, len(out), CHUNK):
            rows = slice(start, start + CHUNK)
            sums = table @ harmonics(position_e[rows], degree).reshape(table.shape[1], -1)
            out[rows] = (sums[:size] + elapsed[rows] * sums[size:]).T
    return out


def unpack_gradient(entries: np.ndarray) -> np.ndarray:
    """Return the symmetric (n, 3, 3) tensors from (n, 6) entries in the order of ``PAIRS``."""
    out = np.empty((len(entries), 3, 3))
    for column, (j, k) in enumerate(PAIRS):
        out[:, j, k] = out[:, k, j] = entries[:, column]
    return out
