"""Finite filters that advance and differentiate sampled signals, with a stated number of rows to look ahead.

A spline looks at the whole piece and a central difference is wrong by 2 % at 0.6 Hz. Weighted least squares over
frequency gives filters that are as exact as the rows allow which they may see: with some rows after their own to some
1e-6 of a motion in the band of compensation, without any to some 1e-3.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from magsim.threads import one_blas_thread

HISTORY_ROWS = 10
"""Rows before its own that a filter sees."""

_TOP_HZ = 0.8
"""Motion of an aircraft: flat up to here, falling with the eighth power of the frequency above."""

_NOISE = 3e-6
"""Deviation of the noise of a row over that of the motion: 0.1 nT of 30 000 nT."""


@dataclass(frozen=True)
class Taps:
    """A filter: the sum of weights times rows at offsets from ``-history`` to ``lookahead``.

    Attributes
    ----------
    weights : (history + 1 + lookahead,)
    lookahead : int
    """

    weights: np.ndarray
    lookahead: int

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Filter the rows of a piece, (n, ...); before its first and after its last row it is taken to rest.

        The order of the sum is fixed, so that a stream computes the same bits.
        """
        history = len(self.weights) - 1 - self.lookahead
        padded = np.concatenate(
            [values[:1].repeat(history, axis=0), values, values[-1:].repeat(self.lookahead, axis=0)]
        )
        out = self.weights[0] * padded[: len(values)]
        for offset, weight in enumerate(self.weights[1:], start=1):
            out += weight * padded[offset : offset + len(values)]
        return out


class _Weighting(NamedTuple):
    """What the design of all filters of one shape and rate has in common.

    Attributes
    ----------
    omega : (k,) [rad/s]
    cosines, sines : (k, m)
        Of the phase of each row at each frequency, weighted by the spectrum of motion, over the number of frequencies.
    normal : (m, m)
        Mean squared error as a function of the weights.
    """

    omega: np.ndarray
    cosines: np.ndarray
    sines: np.ndarray
    normal: np.ndarray


@lru_cache(maxsize=16)
def _weighting(lookahead: int, rate_hz: float, history: int) -> _Weighting:
    offsets = _offsets(lookahead, rate_hz, history)
    omega = 2.0 * np.pi * np.linspace(0.0, 0.5 * rate_hz, 512)
    power = 1.0 / (1.0 + (omega / (2.0 * np.pi * _TOP_HZ)) ** 8)
    power /= power.sum()
    phase = omega[:, None] * offsets
    cosines, sines = power[:, None] * np.cos(phase), power[:, None] * np.sin(phase)
    normal = np.einsum("km,kn->mn", cosines, np.cos(phase)) + np.einsum("km,kn->mn", sines, np.sin(phase))
    return _Weighting(omega, cosines, sines, normal + _NOISE**2 * np.eye(len(offsets)))


def _offsets(lookahead: int, rate_hz: float, history: int) -> np.ndarray:
    return np.arange(-history, lookahead + 1) / rate_hz


@lru_cache(maxsize=256)
def taps(order: int, advance_s: float, lookahead: int, rate_hz: float, history: int = HISTORY_ROWS) -> Taps:
    """Design the filter of a derivative of a signal at a later time.

    It minimizes the mean squared error for a motion with the spectrum above and white noise in every row, and is exact
    for a straight line (for a parabola if ``order`` is 2).

    Parameters
    ----------
    order : int
        0 the signal itself, 1 or 2 its derivatives by time.
    advance_s : float [s]
        How much later than its row the signal is wanted; the lag of an instrument.
    lookahead, history : int
        Rows after and before its own that the filter sees.
    rate_hz : float
    """
    offsets = _offsets(lookahead, rate_hz, history)
    omega, cosines, sines, normal = _weighting(lookahead, rate_hz, history)
    wanted = (1j * omega) ** order * np.exp(1j * omega * advance_s)
    right = np.einsum("k,km->m", wanted.real, cosines) + np.einsum("k,km->m", wanted.imag, sines)
    degrees = range(max(order, 1) + 1)
    exact = np.array([offsets**degree for degree in degrees])
    target = np.array([_derivative_of_power(degree, order, advance_s) for degree in degrees])
    size = len(offsets)
    system = np.block([[normal, exact.T], [exact, np.zeros((len(exact), len(exact)))]])
    with one_blas_thread():
        weights = np.linalg.solve(system, np.concatenate([right, target]))[:size]
    weights.setflags(write=False)
    return Taps(weights, lookahead)


def _derivative_of_power(degree: int, order: int, at_s: float) -> float:
    """Return the derivative of t^degree at a time."""
    factor = float(np.prod([degree - k for k in range(order)])) if order else 1.0
    return factor * at_s ** (degree - order) if degree >= order else 0.0
