"""Compiled loops over the samples of a flight: plain sums in a fixed order, without temporary arrays.

Vectors of samples are rows, (n, 3); fields at places of a body come place by place, (p, n, 3). Results are made by
numpy, not inside of the loops: where it can, it has large ones on large pages, and a fresh one on small pages costs
more than what is computed into it.
"""

import math

import numpy as np

from magsim.storage.compiled import compiled

BLOCK = 128
"""Samples that are worked on at once where that is faster."""


def spline_in_body(curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray, rot_be: np.ndarray) -> np.ndarray:
    """Return Earth-fixed vectors on cubic splines, turned into body axes.

    Parameters
    ----------
    curve : (4, k, 3)
        Coefficients of the pieces, the highest power first.
    knots : (k + 1,)
    time_s : (n,)
        In order, inside the knots.
    rot_be : (n, 3, 3)

    Returns
    -------
    (n, 3)
    """
    out = np.empty((len(time_s), 3))
    _spline_in_body(curve, knots, time_s, rot_be, out)
    return out


@compiled
def _spline_in_body(
    curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray, rot_be: np.ndarray, out: np.ndarray
) -> None:
    piece, last = 0, len(knots) - 2
    for n in range(len(time_s)):
        while piece < last and time_s[n] >= knots[piece + 1]:
            piece += 1
        s = time_s[n] - knots[piece]
        c = curve[:, piece]
        x = ((c[0, 0] * s + c[1, 0]) * s + c[2, 0]) * s + c[3, 0]
        y = ((c[0, 1] * s + c[1, 1]) * s + c[2, 1]) * s + c[3, 1]
        z = ((c[0, 2] * s + c[1, 2]) * s + c[2, 2]) * s + c[3, 2]
        for i in range(3):
            out[n, i] = rot_be[n, i, 0] * x + rot_be[n, i, 1] * y + rot_be[n, i, 2] * z


@compiled
def rotated(rot: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) turned by rotations (n, 3, 3)."""
    out = np.empty_like(vectors)
    for n in range(len(vectors)):
        for i in range(3):
            out[n, i] = rot[n, i, 0] * vectors[n, 0] + rot[n, i, 1] * vectors[n, 1] + rot[n, i, 2] * vectors[n, 2]
    return out


def expanded_in_body(
    curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray, rot_be: np.ndarray, arms_b: np.ndarray
) -> np.ndarray:
    """Return a field near a path by its derivatives there, to first or second order, in body axes.

    Parameters
    ----------
    curve : (4, k, 9) or (4, k, 19)
        Coefficients of cubic pieces, the highest power first: field, gradient ``xx xy xz yy yz zz`` and, to second
        order, ``xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz``, Earth-fixed axes.
    knots : (k + 1,)
    time_s : (n,)
        In order, inside the knots.
    rot_be : (n, 3, 3)
    arms_b : (p, 3) [m]
        Places of the body from the path.

    Returns
    -------
    (p, n, 3)
    """
    out = np.empty((len(arms_b), len(time_s), 3))
    _expanded_in_body(curve, knots, time_s, rot_be, arms_b, out)
    return out


@compiled
def _expanded_in_body(
    curve: np.ndarray,
    knots: np.ndarray,
    time_s: np.ndarray,
    rot_be: np.ndarray,
    arms_b: np.ndarray,
    out: np.ndarray,
) -> None:
    width = curve.shape[2]
    v, arm = np.empty(width), np.empty(3)
    piece, last = 0, len(knots) - 2
    for n in range(len(time_s)):
        while piece < last and time_s[n] >= knots[piece + 1]:
            piece += 1
        s = time_s[n] - knots[piece]
        for i in range(width):
            v[i] = ((curve[0, piece, i] * s + curve[1, piece, i]) * s + curve[2, piece, i]) * s + curve[3, piece, i]
        for p in range(len(arms_b)):
            for j in range(3):
                arm[j] = (
                    rot_be[n, 0, j] * arms_b[p, 0] + rot_be[n, 1, j] * arms_b[p, 1] + rot_be[n, 2, j] * arms_b[p, 2]
                )
            a, b, c = arm[0], arm[1], arm[2]
            x = v[0] + (v[3] * a + v[4] * b + v[5] * c)
            y = v[1] + (v[4] * a + v[6] * b + v[7] * c)
            z = v[2] + (v[5] * a + v[7] * b + v[8] * c)
            if width > 9:
                aa, ab, ac, bb, bc, cc = 0.5 * a * a, a * b, a * c, 0.5 * b * b, b * c, 0.5 * c * c
                x += v[9] * aa + v[10] * ab + v[11] * ac + v[12] * bb + v[13] * bc + v[14] * cc
                y += v[10] * aa + v[12] * ab + v[13] * ac + v[15] * bb + v[16] * bc + v[17] * cc
                z += v[11] * aa + v[13] * ab + v[14] * ac + v[16] * bb + v[17] * bc + v[18] * cc
            for i in range(3):
                out[p, n, i] = rot_be[n, i, 0] * x + rot_be[n, i, 1] * y + rot_be[n, i, 2] * z


def summed(gains: np.ndarray, strengths: np.ndarray) -> np.ndarray:
    """Return the sum over sources of gains (s, 3, c) times strengths (n, c), (s, n, 3)."""
    out = np.empty((len(gains), len(strengths), 3))
    _sum(gains, strengths, out)
    return out


@compiled
def _sum(gains: np.ndarray, strengths: np.ndarray, out: np.ndarray) -> None:
    places, _, width = gains.shape
    for s in range(places):
        for n in range(len(strengths)):
            x = y = z = 0.0
            for c in range(width):
                strength = strengths[n, c]
                x += gains[s, 0, c] * strength
                y += gains[s, 1, c] * strength
                z += gains[s, 2, c] * strength
            out[s, n, 0], out[s, n, 1], out[s, n, 2] = x, y, z


@compiled
def add_turning_dipole(out: np.ndarray, scale: float, terms: np.ndarray, cos: np.ndarray, sin: np.ndarray) -> None:
    """Add the field of a dipole whose ray and moment are linear in cosine and sine of an angle.

    Parameters
    ----------
    out : (s, n, 3) [nT]
    scale : float
        mu0 / 4 pi in the units of ``out``.
    terms : (s, 8, 3)
        For each place what is constant, goes with the cosine and with the sine: of the squared distance, of moment
        times ray, of ray x, y, z and moment x, y, z.
    cos, sin : (n,)
    """
    c, d, part = np.ones(BLOCK), np.zeros(BLOCK), np.empty((5, BLOCK))
    for first in range(0, len(cos), BLOCK):
        count = min(BLOCK, len(cos) - first)
        for k in range(count):
            c[k], d[k] = cos[first + k], sin[first + k]
        for s in range(len(terms)):
            _turning_dipole(scale, terms[s], c, d, part)
            for k in range(count):
                out[s, first + k, 0] += part[0, k]
                out[s, first + k, 1] += part[1, k]
                out[s, first + k, 2] += part[2, k]


@compiled
def _turning_dipole(scale: float, t: np.ndarray, c: np.ndarray, d: np.ndarray, out: np.ndarray) -> None:
    """Write the field of a block of samples, axis by axis, into (3 and 2 more, BLOCK): loops of vector instructions."""
    cubed, radial = out[3], out[4]
    a0, a1, a2, b0, b1, b2 = t[0, 0], t[0, 1], t[0, 2], t[1, 0], t[1, 1], t[1, 2]
    for k in range(BLOCK):
        inverse = 1.0 / (a0 + a1 * c[k] + a2 * d[k])
        cubed[k] = scale * inverse * math.sqrt(inverse)
        radial[k] = 3.0 * cubed[k] * inverse * (b0 + b1 * c[k] + b2 * d[k])
    for i in range(3):
        field = out[i]
        r0, r1, r2, m0, m1, m2 = t[2 + i, 0], t[2 + i, 1], t[2 + i, 2], t[5 + i, 0], t[5 + i, 1], t[5 + i, 2]
        for k in range(BLOCK):
            field[k] = radial[k] * (r0 + r1 * c[k] + r2 * d[k]) - cubed[k] * (m0 + m1 * c[k] + m2 * d[k])


@compiled
def drag(values: np.ndarray, radius: float, state: np.ndarray) -> None:
    """Drag the play operators of the columns of (n, c) from one end to the other; ``state`` (c,) goes along."""
    for c in range(values.shape[1]):
        y = state[c]
        for n in range(len(values)):
            y = min(max(y, values[n, c] - radius), values[n, c] + radius)
        state[c] = y


@compiled
def add_played(values: np.ndarray, radius: float, state: np.ndarray, weight: float, out: np.ndarray) -> None:
    """Add the play operators of the columns of (n, c), times a weight, to ``out``; ``state`` (c,) is before them."""
    for c in range(values.shape[1]):
        y = state[c]
        for n in range(len(values)):
            y = min(max(y, values[n, c] - radius), values[n, c] + radius)
            out[n, c] += weight * y


@compiled
def relax(values: np.ndarray, steps: tuple[float, float, float], state: np.ndarray) -> None:
    """Step ``q[n+1] = decay q[n] + before u[n] + after u[n+1]`` from the first sample of (n, c) to the last.

    ``steps`` are the three factors; ``state`` (c,) goes along.
    """
    decay, before, after = steps
    for c in range(values.shape[1]):
        q = state[c]
        for n in range(1, len(values)):
            q = decay * q + before * values[n - 1, c] + after * values[n, c]
        state[c] = q


@compiled
def add_relaxed(
    values: np.ndarray, steps: tuple[float, float, float], state: np.ndarray, weight: float, out: np.ndarray
) -> None:
    """Add what ``relax`` steps through, times a weight, to ``out`` (n, c); ``state`` (c,) is at the first sample."""
    decay, before, after = steps
    for c in range(values.shape[1]):
        q = state[c]
        out[0, c] += weight * q
        for n in range(1, len(values)):
            q = decay * q + before * values[n - 1, c] + after * values[n, c]
            out[n, c] += weight * q


@compiled
def step_modes(driven: np.ndarray, steps: np.ndarray, start: np.ndarray) -> None:
    """Step modes along a flight, ``q[n] = decay q[n-1] + before s[n-1] + now s[n]``.

    Parameters
    ----------
    driven : (n, k)
        ``s``; after the call, ``q``.
    steps : (3, k)
        ``decay``, ``before`` and ``now``.
    start : (k,)
        ``q`` at the first sample.
    """
    width = len(start)
    decay, before, now = steps[0], steps[1], steps[2]
    state, last = start.copy(), driven[0].copy()
    driven[0] = start
    for n in range(1, len(driven)):
        row = driven[n]
        for k in range(width):
            s = row[k]
            state[k] = decay[k] * state[k] + before[k] * last[k] + now[k] * s
            last[k] = s
            row[k] = state[k]
