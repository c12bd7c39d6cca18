"""What steel remembers: magnetic hysteresis by play operators, and slow (viscous) magnetization.

Both make of the ambient field ``B_0`` in body axes another field ``z`` that the steel answers like the first: at a
mount they add ``D z``. Each axis has its own memory.
"""

import math
from collections.abc import Sequence

import numpy as np

from magsim.aircraft.magnetics import Memory
from magsim.field.kernels import add_played, add_relaxed, drag, relax
from magsim.field.stepping import hold_weights
from magsim.scenario import MemoryPart


def play(values: np.ndarray, radius: float, start: np.ndarray) -> np.ndarray:
    """Apply the play operator: the motion of a pin dragged by a slot of half width ``radius``.

    ``y[n] = min(max(y[n-1], u[n] - r), u[n] + r)`` (A. Visintin, Differential Models of Hysteresis, III.2).

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
    out = np.zeros(values.shape)
    add_played(values, radius, np.array(start, dtype=float), 1.0, out)
    return out


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
    out = np.zeros(ambient_b.shape)
    for radius, weight in zip(radii_nt, weights, strict=True):
        state = np.zeros(ambient_b.shape[1]) if start == "demagnetized" else ambient_b[0].copy()
        if start == "settled":
            # A whole flight is one clip: flown once more, it changes nothing.
            drag(ambient_b, radius, state)
        add_played(ambient_b, radius, state, weight, out)
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
    out = np.zeros(ambient_b.shape)
    for time, weight in zip(times_s, weights, strict=True):
        share = step_s / time
        before, after = (share * value.real for value in hold_weights(-share))
        steps, state = (math.exp(-share), before, after), ambient_b[0].copy()
        if start != "aligned":
            state = np.zeros(ambient_b.shape[1])
        if start == "settled":
            relax(ambient_b, steps, state)
            state /= -math.expm1(-(len(ambient_b) - 1) * share)
        add_relaxed(ambient_b, steps, state, weight, out)
    return out


def remembered(memory: Memory, ambient_b: np.ndarray, step_s: float, settings: MemoryPart) -> np.ndarray:
    """Return the field ``z`` that the steel answers beside the ambient one, (n, 3) [nT].

    Parameters
    ----------
    memory : Memory
        Of the aircraft file.
    ambient_b : (n, 3) [nT]
    step_s : float [s]
    settings : MemoryPart
        Which of hysteresis and viscosity are on, and the state before the first sample.
    """
    state = np.zeros(ambient_b.shape)
    if settings.hysteresis:
        state += hysteresis(ambient_b, memory.radii_nt, memory.weights, settings.start)
    if settings.viscosity:
        state += viscosity(ambient_b, memory.viscosity_s, memory.viscosity_weights, step_s, settings.start)
    return state
