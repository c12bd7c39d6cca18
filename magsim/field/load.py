"""Loads of the flight on what is fixed in the aircraft."""

import numpy as np

from magsim.field.stepping import derivative
from magsim.frames import rotate_back
from magsim.trajectory import Trajectory
from magsim.units import G0


def specific_force(motion: Trajectory, rot_nb: np.ndarray, step_s: float, place_b: np.ndarray) -> np.ndarray:
    """Return the reading of an accelerometer fixed at a place of the rigid aircraft, body axes.

    The rotation of the Earth and of the local frame is left out: below 0.02 m/s^2 at 100 m/s.

    Parameters
    ----------
    motion : Trajectory
        At evenly spaced times.
    rot_nb : (n, 3, 3)
        Of that motion.
    step_s : float [s]
    place_b : (3,) [m]

    Returns
    -------
    (n, 3) [m/s^2]
        ``(0, 0, -g)`` in straight and level flight.
    """
    arm, rate = np.asarray(place_b, dtype=float) - motion.reference_b, motion.rate_b
    acceleration_n = derivative(motion.velocity_n, step_s) - np.array([0.0, 0.0, G0])
    out = rotate_back(rot_nb, acceleration_n)
    out += np.cross(derivative(rate, step_s), arm) + np.cross(rate, np.cross(rate, arm))
    return out


def load_g(force_b: np.ndarray) -> np.ndarray:
    """Return a specific force (n, 3) [m/s^2] less that of the parked aircraft, ``(0, 0, -g)``, in g."""
    return force_b / G0 - np.array([0.0, 0.0, -1.0])
