"""Grid directions near the poles, where the direction of north changes quickly along a path.

Beyond 80 degrees directions are counted from a fixed one: headings plus a multiple of the longitude do not jump at the
pole, where headings and longitudes both do (grid navigation, Bowditch, American Practical Navigator,
chapter on polar navigation).
"""

import math

import numpy as np

POLAR_RAD = math.radians(80.0)
"""Latitude from which on grid directions are used."""


def grid_turn(lat_rad: float) -> float:
    """Return the multiple of the longitude that converts headings to grid headings at a latitude [rad].

    Returns
    -------
    float
        -1 near the north pole, 1 near the south pole, else 0.
    """
    return 0.0 if abs(lat_rad) < POLAR_RAD else -math.copysign(1.0, lat_rad)


def grid_turn_of(lat_rad: np.ndarray) -> float:
    """Return ``grid_turn`` for a whole path, (n,) [rad]: that of its latitude nearest to a pole."""
    return grid_turn(float(lat_rad[int(np.argmax(np.abs(lat_rad)))]))
