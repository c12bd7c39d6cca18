"""What steel remembers: magnetic hysteresis by play operators, and slow (viscous) magnetization.

Both make of the ambient field ``B_0`` in body axes another field ``z`` that the steel answers like the first: at a
mount they add ``D z``. Each axis has its own memory.
"""

import math
from collections.abc import Sequence

import numpy as np

from magsim.aircraft.magnetics import Memory
from magsim.field.stepping import first_order
from magsim.scenario import MemoryPart


def play(values: np.ndarray, radius: float, start: np.ndarray) -> np.ndarray:
    """Apply the play operator: the motion of a pin dragged by a slot of half width ``radius``.

    ``y[n] = min(max(y[n-1], u[n] - r), u[n] + r)`` (A. Visintin, Differential Models of Hysteresis, III.2). Each step
    clips the state to an interval, and clips in a row are one clip. So blocks of the record are gone through side by
    side, each as the clip that it is from its beginning to each of its samples; the state at the beginning of each
    block comes last. The result is that of the plain recursion to the last bit.

    Parameters
    ----------
    values : (n, c)
    radius : float
        Not negative, in the unit of ``values``.
    start : (c,)
        State before the first sample.

    Returns
    -------
    (n, c)
    """
    count, width = values.shape
    length = max(1, math.isqrt(count))
    blocks = -(-count // length)
    # The last value again and again changes nothing: a clip twice is the clip.
    padded = np.concatenate([values, np.repeat(values[-1:], blocks * length - count, axis=0)])
    inside = np.ascontiguousarray(padded.reshape(blocks, length, width).transpose(1, 0, 2))
    low, high = inside - radius, inside + radius
    lowest, highest = low.copy(), high.copy()
    for i in range(1, length):
        for bound in (lowest, highest):
            np.maximum(bound[i - 1], low[i], out=bound[i])
            np.minimum(bound[i], high[i], out=bound[i])
    state, starts = np.asarray(start, dtype=float), np.empty((blocks, width))
    for k in range(blocks):
        starts[k] = state
        state = np.minimum(np.maximum(state, lowest[-1, k]), highest[-1, k])
    out = np.minimum(np.maximum(starts, lowest), highest)
    return out.transpose(1, 0, 2).reshape(blocks * length, width)[:count]


def hysteresis(ambient_b: np.ndarray, radii_nt: Sequence[float], weights: Sequence[float], start: str) -> np.ndarray:
    """Return the Prandtl-Ishlinskii sum of play operators, ``z = sum_j w_j P_rj[B_0]`` in each axis.

    Parameters
    ----------
    ambient_b : (n, 3) [nT]
    radii_nt : (j,) [nT]
    weights : (j,)
    start : {"settled", "aligned", "demagnetized"}
        State before the first sample: as if the same flight had been flown before; every operator at the first field,
        as after demagnetization in it; zero, as after demagnetization in no field.

    Returns
    -------
    (n, 3) [nT]
    """
    out = np.zeros_like(ambient_b)
    for radius, weight in zip(radii_nt, weights, strict=True):
        state = np.zeros(ambient_b.shape[1]) if start == "demagnetized" else ambient_b[0]
        if start == "settled":
            # A whole flight is one clip as well: flown once more, it changes nothing.
            state = play(ambient_b, radius, state)[-1]
        out += weight * play(ambient_b, radius, state)
    return out


def viscosity(
    ambient_b: np.ndarray, times_s: Sequence[float], weights: Sequence[float], step_s: float, start: str
) -> np.ndarray:
    """Return slow magnetization ``z = sum_j v_j z_j``, ``T_j dz_j/dt = B_0 - z_j``, exact for straight lines.

    Parameters
    ----------
    ambient_b : (n, 3) [nT]
    times_s : (j,) [s]
    weights : (j,)
    step_s : float [s]
    start : {"settled", "aligned", "demagnetized"}
        Before the first sample: the state that the same flight, flown over and over, comes back to; the first field;
        zero.

    Returns
    -------
    (n, 3) [nT]
    """
    out = np.zeros_like(ambient_b)
    zero = np.zeros(ambient_b.shape[1])
    for time, weight in zip(times_s, weights, strict=True):
        drive = ambient_b / time
        state = zero if start == "demagnetized" else ambient_b[0]
        if start == "settled":
            flown = first_order(-1.0 / time, drive, step_s, zero)[-1]
            state = flown / -math.expm1(-(len(ambient_b) - 1) * step_s / time)
        out += weight * first_order(-1.0 / time, drive, step_s, state)
    return out


def remembered(memory: Memory | None, ambient_b: np.ndarray, step_s: float, settings: MemoryPart) -> np.ndarray | None:
    """Return the field ``z`` that the steel answers beside the ambient one, (n, 3) [nT].

    Parameters
    ----------
    memory : Memory, optional
        Of the aircraft file; without one the result is None.
    ambient_b : (n, 3) [nT]
    step_s : float [s]
    settings : MemoryPart
        Which of hysteresis and viscosity are on, and the state before the first sample.
    """
    if memory is None:
        return None
    state = np.zeros_like(ambient_b)
    if settings.hysteresis:
        state += hysteresis(ambient_b, memory.radii_nt, memory.weights, settings.start)
    if settings.viscosity:
        state += viscosity(ambient_b, memory.viscosity_s, memory.viscosity_weights, step_s, settings.start)
    return state
