"""Play operators: the field's history as steel remembers it.

The state of a play operator of half width r follows its input where that pushes it and rests elsewhere; weighted sums
of such states are the hysteresis of Prandtl and Ishlinskii (Krasnosel'skii and Pokrovskii, Systems with Hysteresis,
Springer 1989). It is rate-independent, as hysteresis of steel is at the frequencies of an aircraft's motion.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

WIDTHS_NT = (2500.0, 7500.0, 15000.0)
"""Half widths: an aircraft that turns and rolls changes the field along each of its axes by some 1000 to 40 000 nT, and
remembers what lies between. A third of that, and a third again (estimate)."""


@njit(cache=True)
def _play(values: np.ndarray, half_width: float, state: np.ndarray, into: np.ndarray) -> None:
    """Add the states to ``into`` (n, 3) and leave the last one in ``state`` (3,)."""
    for row in range(len(values)):
        for axis in range(values.shape[1]):
            held = state[axis]
            low, high = values[row, axis] - half_width, values[row, axis] + half_width
            held = low if held < low else (high if held > high else held)
            state[axis] = held
            into[row, axis] += held


def remembered(background: np.ndarray, *, repeated: bool = False, widths_nt: Sequence[float] = WIDTHS_NT) -> np.ndarray:
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
    (n, 3) [nT]
    """
    values = np.ascontiguousarray(background)
    out = np.zeros_like(values)
    for half_width in widths_nt:
        state = values[0].copy()
        if repeated:
            _play(values, half_width, state, np.zeros_like(values))
        _play(values, half_width, state, out)
    return out / len(widths_nt)
