"""Modes of a chain about its equilibrium: frequencies, damping, and whether one of them grows.

A towed body can become unstable without any gust: with a short rope, whose pendulum frequency comes near that of the
body's yaw, or with fins that are too small.
"""

import math
from typing import NamedTuple

import numpy as np

from magsim.flight.tow.chain import Chain
from magsim.flight.tow.dynamics import GAMMA, state_derivative
from magsim.flight.tow.equilibrium import Equilibrium, hanging_state
from magsim.units import G0

STEP = 1e-6
"""Step of the differences [m, m/s, rad/s, 1]: the error of the derivative is below 1e-6."""

STILL = 1e-3
"""Eigenvalues [1/s] below this are those of the quaternion's length and the heading, which have no restoring force."""

OFF = 0.01
"""Distance [1/s] from the double root of the constraints of the links' lengths, which is no motion."""


class ChainMode(NamedTuple):
    """A mode of a chain.

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
        """Damping ratio: over the critical damping."""
        return -self.growth_ps / math.hypot(self.growth_ps, 2.0 * math.pi * self.frequency_hz)


def level_tow(speed_mps: float, density: float) -> np.ndarray:
    """Return the forcing of a chain in level tow along the first axis, (10,): see ``dynamics``."""
    return np.array([0.0, 0.0, G0, -speed_mps, 0.0, 0.0, -speed_mps, 0.0, 0.0, density])


def modes(chain: Chain, equilibrium: Equilibrium, speed_mps: float, density: float) -> tuple[ChainMode, ...]:
    """Find the modes about an equilibrium of level tow, the fastest growing first.

    Parameters
    ----------
    chain : Chain
    equilibrium : Equilibrium
    speed_mps : float
        Through the air.
    density : float [kg/m^3]

    Returns
    -------
    tuple of ChainMode
        From the eigenvalues of the equations of motion, linearized by central differences.
    """
    air = level_tow(speed_mps, density)
    state = hanging_state(chain, equilibrium, air)
    matrix = np.empty((chain.size, chain.size))
    ahead, back, tension = np.empty(chain.size), np.empty(chain.size), np.empty(chain.links)
    for j in range(chain.size):
        for slope, step in ((ahead, STEP), (back, -STEP)):
            moved = state.copy()
            moved[j] += step
            state_derivative(chain.constants, moved, air, slope, tension)
        matrix[:, j] = (ahead - back) / (2.0 * STEP)
    values = np.linalg.eigvals(matrix)
    kept = [v for v in values.tolist() if abs(v) > STILL and abs(v + GAMMA) > OFF and v.imag >= 0.0]
    return tuple(sorted((ChainMode(v.imag / (2.0 * math.pi), v.real) for v in kept), key=lambda mode: -mode.growth_ps))
