"""How people move in their seats: postures that are kept for a while, fidgets, and sway."""

import math

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.population.draws import between
from magsim.population.spreads import SEATED, Spread
from magsim.signals.processes import gauss_markov

SWAY_HZ = 1.0
"""Knots a second of the sway; a cubic spline joins them, so no step of the simulation counts."""


def posture(random: np.random.Generator, time_s: np.ndarray, span_s: tuple[float, float]) -> np.ndarray:
    """Return how far a person is from the mean posture, and turned about the vertical, (n, 4) [m], [rad].

    Parameters
    ----------
    random : numpy.random.Generator
    time_s : (n,) [s]
        Rising.
    span_s : tuple of float [s]
        Begin and end of what is drawn, whatever the times.
    """
    out = np.zeros((len(time_s), 4))
    begin, end = span_s
    at = np.zeros(4)
    for start in _times(random, SEATED["shift"], span_s):
        there = _posture(random)
        _move(out, time_s, start, _lasting(random), there - at)
        at = there
    for start in _times(random, SEATED["fidget"], span_s):
        way, ahead, back = SEATED["fidgeting"].size[0] * _posture(random), _lasting(random), _lasting(random)
        _move(out, time_s, start, ahead, way)
        _move(out, time_s, start + ahead, back, -way)
    sigma, correlation_s = SEATED["sway"].size
    count = max(4, math.ceil((end - begin) * SWAY_HZ) + 3)
    knots = begin + (np.arange(count) - 1.0) / SWAY_HZ
    out[:, :3] += CubicSpline(knots, gauss_markov(random, (count, 3), sigma, correlation_s, SWAY_HZ))(time_s)
    return out


def _times(random: np.random.Generator, gap: Spread, span_s: tuple[float, float]) -> list[float]:
    """Return when something begins that happens by chance, at a constant rate."""
    out: list[float] = []
    when = span_s[0]
    while True:
        when += float(random.exponential(gap.size[0]))
        if when >= span_s[1]:
            return out
        out.append(when)


def _lasting(random: np.random.Generator) -> float:
    return between(random, SEATED["lasting"].size)


def _posture(random: np.random.Generator) -> np.ndarray:
    sideways, height = SEATED["posture"].size[0], SEATED["height"].size[0]
    largest = np.array([sideways, sideways, height, math.radians(SEATED["turning"].size[0])])
    return largest * random.uniform(-1.0, 1.0, 4)


def _move(out: np.ndarray, time_s: np.ndarray, start: float, lasting: float, way: np.ndarray) -> None:
    """Add a smooth step (n, 4) in place: of fifth degree, without a jump of speed or acceleration."""
    first, last = np.searchsorted(time_s, [start, start + lasting])
    share = (time_s[first:last] - start) / lasting
    out[first:last] += (share**3 * (10.0 - 15.0 * share + 6.0 * share**2))[:, None] * way
    out[last:] += way
