"""Gusts of the Dryden form after MIL-F-8785C: how strong and how long they are at a height, and their filters.

Sources: MIL-F-8785C (1980), 3.7; the same forms in the manual of
MathWorks' *Dryden Wind Turbulence Model*. Heights count from the ground. Everything here is SI.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim.storage.compiled import compiled
from magsim.units import FT

KNOT = 1852.0 / 3600.0
SQRT2, SQRT3 = math.sqrt(2.0), math.sqrt(3.0)

LOW_M, HIGH_M = 1000.0 * FT, 2000.0 * FT
"""Below the first height the laws near the ground hold, above the second those of the free air; straight between."""

LOWEST_M = 10.0 * FT
"""The laws near the ground begin here."""

FREE_LENGTH_M = 1750.0 * FT
"""Length of the gusts in the free air."""

WIND_20FT_MPS = tuple(knots * KNOT for knots in (7.3, 9.5, 15.0, 30.0, 37.5, 45.0, 52.5))
"""Wind at 20 ft of severities 1 to 7, on which gusts near the ground depend.

15, 30 and 45 kt are those of light, moderate and severe turbulence (3.7.3.4), which figure 7 calls its curves of 1e-2,
1e-3 and 1e-5: severities 3, 4 and 6. The others are estimates: 1 and 2 in the proportions of figure 7 at 500 ft, 5 and
7 in steps of 7.5 kt for a power of ten, as from 4 to 6.
"""

EXCEEDANCE_FT = (500.0, 1750.0, 3750.0, 7500.0, 15e3, 25e3, 35e3, 45e3, 55e3, 65e3, 75e3, 80e3)
EXCEEDANCE_FPS = (
    (3.2, 2.2, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (4.2, 3.6, 3.3, 1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (6.6, 6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0),
    (8.6, 9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0.0, 0.0, 0.0),
    (11.8, 13.0, 16.0, 15.1, 11.6, 9.7, 8.1, 8.2, 7.9, 4.9, 3.2, 2.1),
    (15.6, 17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9, 6.2, 5.1),
    (18.7, 21.5, 28.4, 30.2, 30.7, 31.0, 25.2, 23.1, 17.5, 10.7, 8.4, 7.2),
)
"""Standard deviation [ft/s] that is exceeded with a probability of 2e-1, 1e-1, 1e-2 ... 1e-6, by height (figure 7)."""

LEAST_MPS = (0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.75)
"""What a severity is at least in the free air (estimate): figure 7 has nothing where the air is calm that often."""


class Gustiness(NamedTuple):
    """Gusts at a height: standard deviations [m/s] and lengths [m], level (along and across) and vertical."""

    level_mps: float
    vertical_mps: float
    level_m: float
    vertical_m: float


@dataclass(frozen=True)
class Strength:
    """How strong gusts are: by severity, or by the standard deviation of the vertical ones.

    Attributes
    ----------
    severity : int
        1 to 7: the probability of exceedance of MIL-F-8785C's figure 7; 0 with ``vertical_mps``.
    vertical_mps : float
        The same at every height; 0 with a severity.
    """

    severity: int = 0
    vertical_mps: float = 0.0

    def low(self) -> float:
        """Return the standard deviation of vertical gusts below ``LOW_M`` [m/s]: 0.1 of the wind at 20 ft."""
        return self.vertical_mps or 0.1 * WIND_20FT_MPS[self.severity - 1]

    def free(self, height_m: float) -> float:
        """Return the standard deviation of each component in the free air [m/s], straight between figure 7's points."""
        if self.vertical_mps:
            return self.vertical_mps
        height, read = height_m / FT, EXCEEDANCE_FPS[self.severity - 1]
        above = bisect_right(EXCEEDANCE_FT, height)
        if above in (0, len(read)):
            value = read[min(above, len(read) - 1)]
        else:
            (low, high), (before, after) = EXCEEDANCE_FT[above - 1 : above + 1], read[above - 1 : above + 1]
            value = before + (after - before) * (height - low) / (high - low)
        return max(value * FT, LEAST_MPS[self.severity - 1])

    def at(self, height_m: float) -> Gustiness:
        """Return the gusts at a height above ground."""
        if height_m >= HIGH_M:
            free = self.free(height_m)
            return Gustiness(free, free, FREE_LENGTH_M, FREE_LENGTH_M)
        low, height = self.low(), max(min(height_m, LOW_M), LOWEST_M)
        shape = 0.177 + 0.000823 * height / FT
        near = Gustiness(low / shape**0.4, low, height / shape**1.2, height)
        if height_m <= LOW_M:
            return near
        free, part = self.free(HIGH_M), (height_m - LOW_M) / (HIGH_M - LOW_M)
        above = Gustiness(free, free, FREE_LENGTH_M, FREE_LENGTH_M)
        return Gustiness(*(a + part * (b - a) for a, b in zip(near, above, strict=True)))


class AirMotion(NamedTuple):
    """Gusts at one moment: motion of the air along and across the course and down [m/s], and its rotation [rad/s].

    The rotation is that of the air over the aircraft's size, about the body's axes: what the aircraft's own rates are
    relative to.
    """

    along: float
    across: float
    down: float
    roll: float
    pitch: float
    yaw: float


class DrydenFilters:
    """White noise shaped to the spectra of MIL-F-8785C, exactly from one node to the next.

    With ``x = L Omega`` the spectra are ``2 / (1 + x^2)`` along and ``(1 + 3 x^2) / (1 + x^2)^2`` across and down, and
    those of rotation follow from a wing of span ``b``: pitch and yaw are the slopes of the vertical and
    the lateral gust along the path, smoothed over ``4 b / pi`` and ``3 b / pi``; roll has a noise of its own.
    States are those of gusts of unit deviation, so strength and lengths may change from node to node.

    Parameters
    ----------
    span_m : float
    start : (6,)
        Standard normal numbers for the states at the first node.
    """

    def __init__(self, span_m: float, start: np.ndarray) -> None:
        self._pitch_m, self._yaw_m = 4.0 * span_m / math.pi, 3.0 * span_m / math.pi
        half = math.sqrt(0.5)
        # In the steady state the two poles have variances 1/2 and 1/4 and a covariance of 1/4.
        across = half * float(start[1]), 0.5 * half * float(start[1] + start[2])
        down = half * float(start[3]), 0.5 * half * float(start[3] + start[4])
        # along; both poles across and down; roll; the last value and its low-pass across and down
        self._state = np.array([float(start[0]), *across, *down, float(start[5]), 0.0, 0.0, 0.0, 0.0])

    def advance(self, gustiness: Gustiness, path_m: float, noise: np.ndarray) -> AirMotion:
        """Return the gusts a way through the air further on.

        Parameters
        ----------
        gustiness : Gustiness
            On the way.
        path_m : float
        noise : (6,)
            Standard normal numbers.
        """
        return AirMotion(*_advance(self._state, *gustiness, path_m, self._pitch_m, self._yaw_m, noise))


@compiled
def _advance(
    state: np.ndarray,
    level: float,
    vertical: float,
    level_m: float,
    vertical_m: float,
    path_m: float,
    pitch_m: float,
    yaw_m: float,
    noise: np.ndarray,
) -> tuple[float, float, float, float, float, float]:
    """Step the states (10,) of a ``DrydenFilters`` by a way; return the fields of an ``AirMotion``."""
    on_level = _step(path_m / level_m)
    on_vertical = on_level if vertical_m == level_m else _step(path_m / vertical_m)
    on_pitch, on_yaw = _smoothing(path_m / pitch_m), _smoothing(path_m / yaw_m)
    state[0] = on_level[0] * state[0] + SQRT2 * on_level[2] * noise[0]
    state[1], state[2] = _two_poles((state[1], state[2]), on_level, noise[1], noise[2])
    state[3], state[4] = _two_poles((state[3], state[4]), on_vertical, noise[3], noise[4])
    state[5] = on_pitch[0] * state[5] + math.sqrt(1.0 - on_pitch[0] ** 2) * noise[5]
    across, down = level * _transverse(state[1], state[2]), vertical * _transverse(state[3], state[4])
    state[6], state[7] = _follow((state[6], state[7]), across, on_yaw)
    state[8], state[9] = _follow((state[8], state[9]), down, on_pitch)
    # The integral of 0.8 (pi L / 4b)^(1/3) / (L (1 + (4b Omega / pi)^2)) from 0 on.
    variance = 0.4 * math.pi / pitch_m * (vertical_m / pitch_m) ** (1.0 / 3.0) / vertical_m
    return (
        level * state[0],
        across,
        down,
        vertical * math.sqrt(variance) * state[5],
        (state[9] - down) / pitch_m,
        (across - state[7]) / yaw_m,
    )


@compiled
def _step(way: float) -> tuple[float, float, float, float, float]:
    """Return what the poles ``1 / (1 + s)`` and ``1 / (1 + s)^2`` of one white noise do over a way in lengths.

    The decay of each, what the first gives to the second, and the Cholesky factor of the covariance of what the noise
    adds, the integral of ``(e^-s, s e^-s)`` with itself from 0 to the way.
    """
    decay = math.exp(-way)
    twice = decay * decay
    spread = math.sqrt(0.5 - 0.5 * twice)
    shared = (0.25 - twice * (0.5 * way + 0.25)) / spread
    own = 0.25 - twice * (0.5 * way * way + 0.5 * way + 0.25) - shared * shared
    return decay, decay * way, spread, shared, math.sqrt(max(0.0, own))


@compiled
def _two_poles(
    state: tuple[float, float], step: tuple[float, float, float, float, float], first: float, second: float
) -> tuple[float, float]:
    """Return the states of both poles after a step."""
    decay, given, spread, shared, own = step
    one, two = state
    return decay * one + spread * first, decay * two + given * one + shared * first + own * second


@compiled
def _transverse(one: float, two: float) -> float:
    """Return the output of ``(1 + sqrt(3) s) / (1 + s)^2`` by its poles; its variance is 1."""
    return SQRT3 * one + (1.0 - SQRT3) * two


@compiled
def _smoothing(way: float) -> tuple[float, float]:
    """Return the decay of ``1 / (1 + s)`` over a way, and its mean."""
    return math.exp(-way), -math.expm1(-way) / way


@compiled
def _follow(state: tuple[float, float], value: float, smoothing: tuple[float, float]) -> tuple[float, float]:
    """Return the value and its low-pass after a way, exact where the value is straight over it."""
    (last, smooth), (decay, mean) = state, smoothing
    return value, decay * smooth + (mean - decay) * last + (1.0 - mean) * value
