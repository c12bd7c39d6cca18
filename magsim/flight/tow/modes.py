"""How a line swings about its equilibrium: its modes, and whether one of them grows by itself.

A towed body can swing up without any gust where rope, fins and speed do not fit: a short rope whose pendulum comes near
the yaw of the body, too small fins.
"""

import math
from typing import NamedTuple

import numpy as np

from magsim.flight.tow.chain import Line
from magsim.flight.tow.dynamics import GAMMA, found
from magsim.flight.tow.equilibrium import Steady, hanging
from magsim.units import G0

STEP = 1e-6
"""Step of the differences [m, m/s, rad/s, 1]: what is left of the derivative's error is below 1e-6."""

STILL = 1e-3
"""Eigenvalues [1/s] below this are those of the quaternion's length and of the heading, which nothing holds."""

OFF = 0.01
"""Distance [1/s] from the double root of the links' lengths, which are held and are no motion."""


class Mode(NamedTuple):
    """A mode of a line.

    Attributes
    ----------
    frequency_hz : float
        0 for one that does not oscillate.
    growth_ps : float [1/s]
        Its amplitude goes as exp(growth t): negative where it decays.
    """

    frequency_hz: float
    growth_ps: float

    @property
    def damping(self) -> float:
        """Over the critical one."""
        return -self.growth_ps / math.hypot(self.growth_ps, 2.0 * math.pi * self.frequency_hz)


def level_tow(speed_mps: float, density: float) -> np.ndarray:
    """What acts on a line in level tow along the first axis, (10,): see ``chain``."""
    return np.array([0.0, 0.0, G0, -speed_mps, 0.0, 0.0, -speed_mps, 0.0, 0.0, density])


def modes(line: Line, steady: Steady, speed_mps: float, density: float) -> tuple[Mode, ...]:
    """Modes about an equilibrium of level tow, those that grow fastest first.

    Parameters
    ----------
    line : Line
    steady : Steady
    speed_mps : float
        Through the air.
    density : float [kg/m^3]

    Returns
    -------
    tuple of Mode
        From the eigenvalues of the equations of motion, made linear by central differences.
    """
    air = level_tow(speed_mps, density)
    state = hanging(line, steady, air)
    matrix = np.empty((line.size, line.size))
    ahead, back, tension = np.empty(line.size), np.empty(line.size), np.empty(line.links)
    for j in range(line.size):
        for slope, step in ((ahead, STEP), (back, -STEP)):
            moved = state.copy()
            moved[j] += step
            found(line.numbers, moved, air, slope, tension)
        matrix[:, j] = (ahead - back) / (2.0 * STEP)
    values = np.linalg.eigvals(matrix)
    kept = [v for v in values.tolist() if abs(v) > STILL and abs(v + GAMMA) > OFF and v.imag >= 0.0]
    return tuple(sorted((Mode(v.imag / (2.0 * math.pi), v.real) for v in kept), key=lambda mode: -mode.growth_ps))
