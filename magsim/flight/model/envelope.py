"""The checks of a plant's rows, compiled: they end a flight that has left what its model is good for."""

import math

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.channels import COLUMN, TO_SI
from magsim.storage.compiled import compiled

TROUBLES = ("", "diverged (not a number)", "touched the ground", "stalled", "diverged")
"""What is wrong with a row, by the code that ``first_outside`` gives."""

ALT, ROLL, PITCH, ALPHA, BETA = (COLUMN[name] for name in ("alt", "roll", "pitch", "alpha", "beta"))
ALT_M = float(TO_SI[ALT])


def limits_of(facts: Facts) -> tuple[np.ndarray, np.ndarray]:
    """Return what the rows of an aircraft are checked against.

    Returns
    -------
    limits : (5,) [rad]
        Lowest and highest angle of attack, largest sideslip, bank and pitch.
    wheels : (n, 3) [m]
        From the center of gravity, body axes.
    """
    limits = facts.limits
    angles = (*limits.angle_of_attack.value, limits.sideslip.value, limits.bank.value, limits.pitch.value)
    wheels = [wheel.value for wheel in facts.geometry.wheels]
    return np.radians(angles), np.array(wheels) - np.array(facts.cg_b)


@compiled
def first_outside(
    rows: np.ndarray, first: int, last: int, limits: np.ndarray, wheels: np.ndarray, ground_m: float
) -> tuple[int, int]:
    """Return the number of the first row that is outside of the limits, and a code of ``TROUBLES``; (last, 0) if none.

    Parameters
    ----------
    rows : (n, c)
        Of the plant, in its units.
    first, last : int
        Numbers of the rows to check, both included.
    limits, wheels : arrays
        From ``limits_of``.
    ground_m : float
        Height of the ground, level between the wheels.
    """
    for number in range(first, last + 1):
        row = rows[number]
        total = 0.0
        for value in row:
            total += value
        if not math.isfinite(total):
            return number, 1
        roll, pitch = row[ROLL], row[PITCH]
        if row[ALT] * ALT_M - _lowest(wheels, roll, pitch) <= ground_m:
            return number, 2
        if not limits[0] < row[ALPHA] < limits[1]:
            return number, 3
        if not (abs(row[BETA]) < limits[2] and abs(roll) < limits[3] and abs(pitch) < limits[4]):
            return number, 4
    return last, 0


@compiled
def _lowest(wheels: np.ndarray, roll: float, pitch: float) -> float:
    """Return how far below the center of gravity the lowest wheel is [m], and at least 0."""
    lowest = 0.0
    for wheel in wheels:
        across = math.sin(roll) * wheel[1] + math.cos(roll) * wheel[2]
        lowest = max(lowest, math.cos(pitch) * across - math.sin(pitch) * wheel[0])
    return lowest
