"""Compiled loops over the samples of what turns: angles of shafts, and the mean of a tone over each step."""

import math

import numpy as np

from magsim.storage.compiled import compiled


@compiled
def integrated(curve: np.ndarray, knots: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Return the integral of a cubic spline from its first knot, its value and two derivatives, (4, n).

    Parameters
    ----------
    curve : (4, k)
        Coefficients of the pieces, the highest power first.
    knots : (k + 1,)
    time_s : (n,)
        In order.
    """
    out = np.empty((4, len(time_s)))
    piece, last, before = 0, len(knots) - 2, 0.0
    for n in range(len(time_s)):
        while piece < last and time_s[n] >= knots[piece + 1]:
            s = knots[piece + 1] - knots[piece]
            a, b, c, d = curve[0, piece], curve[1, piece], curve[2, piece], curve[3, piece]
            before += (((0.25 * a * s + b / 3.0) * s + 0.5 * c) * s + d) * s
            piece += 1
        s = time_s[n] - knots[piece]
        a, b, c, d = curve[0, piece], curve[1, piece], curve[2, piece], curve[3, piece]
        out[0, n] = before + (((0.25 * a * s + b / 3.0) * s + 0.5 * c) * s + d) * s
        out[1, n] = ((a * s + b) * s + c) * s + d
        out[2, n] = (3.0 * a * s + 2.0 * b) * s + c
        out[3, n] = 6.0 * a * s + 2.0 * b
    return out


@compiled
def bessel(x: float) -> tuple[float, float, float, float, float]:
    """Return the spherical Bessel functions of the first kind of orders 0 to 4 (Abramowitz and Stegun, 10.1).

    Their power series, whose next term is below 1e-18, or from 0.5 on the upward recurrence: it loses digits of the
    high orders, which weigh small terms only.

    Parameters
    ----------
    x : float
        Not negative.
    """
    if x >= 0.5:
        sin, cos = math.sin(x), math.cos(x)
        zero = sin / x
        one = (zero - cos) / x
        two = 3.0 / x * one - zero
        three = 5.0 / x * two - one
        return zero, one, two, three, 7.0 / x * three - two
    half, power = -0.5 * x * x, 1.0
    values = np.empty(5)
    for order in range(5):
        term = power
        value = term
        for k in range(1, 9):
            term *= half / (k * (2 * order + 2 * k + 1))
            value += term
        values[order] = value
        power *= x / (2 * order + 3)
    return values[0], values[1], values[2], values[3], values[4]


@compiled
def mean_tones(motion: np.ndarray, step_s: float) -> np.ndarray:
    """Return cosine and sine of a tone, each the mean over the step around a sample, (n, 2).

    See ``magsim.field.sources.rotors.mean_tone``; ``motion`` (4, n) are phase, speed, rise and jerk.
    """
    phase, speed, rise, jerk = motion[0], motion[1], motion[2], motion[3]
    out = np.empty((len(phase), 2))
    for n in range(len(phase)):
        sign = -1.0 if speed[n] < 0.0 else 1.0
        j0, j1, j2, j3, j4 = bessel(abs(speed[n]) * (0.5 * step_s))
        bend, twist = rise[n] * (step_s**2 / 8.0), jerk[n] * (step_s**3 / 48.0)
        square, fourth = (j0 - 2.0 * j2) / 3.0, (7.0 * j0 - 20.0 * j2 + 8.0 * j4) / 35.0
        cube = sign * (3.0 * j1 - 2.0 * j3) / 5.0  # times i
        real = j0 - 0.5 * bend * bend * fourth - twist * cube
        sin, cos = math.sin(phase[n]), math.cos(phase[n])
        out[n, 0] = cos * real - sin * (bend * square)
        out[n, 1] = sin * real + cos * (bend * square)
    return out
