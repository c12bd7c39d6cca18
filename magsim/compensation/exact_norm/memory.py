"""What steel remembers of the field: hysteresis by play operators, and the aftereffect.

The state of a play operator of half width r follows its input where that pushes it and rests elsewhere; weighted sums
of such states are the hysteresis of Prandtl and Ishlinskii (Krasnosel'skii and Pokrovskii, Systems with Hysteresis,
Springer 1989). It is rate-independent, as hysteresis of steel is at the frequencies of an aircraft's motion.

The aftereffect (magnetic viscosity) is what of the magnetization comes late, evenly in the logarithm of time (Street
and Woolley, Proceedings of the Physical Society A 62, 1949, 562): the mean of relaxations, one for each decade.
"""

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

WIDTHS_NT = (2500.0, 7500.0, 15000.0)
"""Half widths to begin with: an aircraft that turns and rolls changes the field along each of its axes by some 1000 to
40 000 nT, and remembers what lies between. A third of that, and a third again (estimate)."""

RELAXATIONS_S = (1.0, 10.0, 100.0)
"""Times of the relaxations: a maneuver, a leg, a circuit of some minutes. Faster ones are lags of eddy currents, slower
ones magnets."""


@njit(cache=True)
def _play(values: np.ndarray, half_width: float, state: np.ndarray, into: np.ndarray, slope: np.ndarray) -> None:
    """Add the states to ``into`` (n, 3), leave the last one in ``state`` (2, 3), the derivatives by the width in slope.

    The derivative, the second line of ``state``, is -1 or 1 once the state has been pushed up or down.
    """
    for row in range(len(values)):
        for axis in range(values.shape[1]):
            held = state[0, axis]
            low, high = values[row, axis] - half_width, values[row, axis] + half_width
            if held < low:
                held, state[1, axis] = low, -1.0
            elif held > high:
                held, state[1, axis] = high, 1.0
            state[0, axis] = held
            into[row, axis] += held
            slope[axis, row] = state[1, axis]


def remembered(
    background: np.ndarray, *, repeated: bool = False, widths_nt: Sequence[float] = WIDTHS_NT
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean state of play operators that follow each axis of the background along a piece.

    Parameters
    ----------
    background : (n, 3) [nT]
    repeated : bool
        The same was flown just before; else the states start at the first row, in the middle of what they may be.
    widths_nt : sequence of float [nT]
        Half widths.

    Returns
    -------
    (n, 3) [nT], (w, 3, n) [nT]
        The mean state, and its derivative by the logarithm of each width.
    """
    values = np.ascontiguousarray(background)
    widths = np.array(widths_nt)
    out, slopes = np.zeros_like(values), np.zeros((len(widths), *values.shape[::-1]))
    for half_width, slope in zip(widths, slopes, strict=True):
        state = np.zeros((2, values.shape[1]))
        state[0] = values[0]
        if repeated:
            _play(values, half_width, state, np.zeros_like(values), slope)
        _play(values, half_width, state, out, slope)
    return out / len(widths), slopes * (widths / len(widths))[:, None, None]


@njit(cache=True)
def _relax(values: np.ndarray, weights: tuple[float, float, float], state: np.ndarray, into: np.ndarray) -> None:
    """Add the states to ``into`` (n, 3), and leave the last one in ``state`` (3,).

    Exact for straight lines: the weights are those of the state, of the row and of the row before.
    """
    keep, now, before = weights
    for row in range(len(values)):
        for axis in range(values.shape[1]):
            if row:
                state[axis] = keep * state[axis] + now * values[row, axis] - before * values[row - 1, axis]
            into[row, axis] += state[axis]


def relaxed(background: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return the mean of the relaxations that follow each axis along a piece that was flown over and over before.

    Parameters
    ----------
    background : (n, 3) [nT]
    rate_hz : float

    Returns
    -------
    (n, 3) [nT]
    """
    values = np.ascontiguousarray(background)
    out = np.zeros_like(values)
    for time_s in RELAXATIONS_S:
        keep = math.exp(-1.0 / (rate_hz * time_s))
        late = rate_hz * time_s * (1.0 - keep)
        weights, state = (keep, 1.0 - late, keep - late), np.zeros(values.shape[1])
        # from nothing, a whole turn leaves what a settled state has not kept of itself
        _relax(values, weights, state, np.zeros_like(values))
        state /= 1.0 - keep ** (len(values) - 1)
        _relax(values, weights, state, out)
    return out / len(RELAXATIONS_S)
