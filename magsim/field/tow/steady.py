"""The background along the smooth track of a bird: what its swing changes is the difference to it."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from magsim.earth import geodetic_from_ecef, rot_ne_at
from magsim.field.background.path import positions_along
from magsim.field.background.whole import Background
from magsim.field.situation import Situation
from magsim.frames import rotate
from magsim.signals import HIGH_PASS_HZ
from magsim.trajectory import Trajectory

SMOOTH_HZ = 2.0
"""Rate at which a path is smoothed."""


def steady_background(below: Situation, mount: str) -> np.ndarray:
    """Return the length of the background where a mount would be without swing, (n,) [nT].

    Parameters
    ----------
    below : Situation
        Of the bird.
    mount : str
    """
    passage = below.passage
    arm_b = below.positions_m[below.mounts.index(mount)] - passage.path.reference_b
    places_e = positions_along(passage.path, arm_b[None], passage.path.time_s)[:, 0]
    smooth = replace(passage.flight, carrier=smoothed(passage.path, places_e))
    field_b = Background(replace(passage, flight=smooth)).center
    return np.sqrt(np.einsum("ni,ni->n", field_b, field_b))


def smoothed(path: Trajectory, places_e: np.ndarray) -> Trajectory:
    """Return a body's path with its places smoothed to motion slower than 0.03 Hz.

    Of all rows of places the one with the least sum of squared distances and ``l`` times that of squared third
    differences (Whittaker; Eilers, Analytical Chemistry 75 (2003) 3631), with ``l`` such that half of a motion of that
    frequency is left. It passes parabolas unchanged, to its ends; there it follows a part of a swing too: within 10 s
    some tenths of it, within 30 s some hundredths.

    Parameters
    ----------
    path : Trajectory
        Gives times and attitude.
    places_e : (n, 3) [m]
        At its rows, Earth-fixed.
    """
    span = path.time_s[-1] - path.time_s[0]
    knots = np.linspace(path.time_s[0], path.time_s[-1], max(8, round(span * SMOOTH_HZ) + 1))
    origin = places_e[0]
    rows = CubicSpline(path.time_s, places_e - origin)(knots)
    weight = (2.0 * np.sin(np.pi * HIGH_PASS_HZ * (knots[1] - knots[0]))) ** -6
    curve = CubicSpline(knots, whittaker(rows, weight))
    lat, lon, alt = geodetic_from_ecef(origin + curve(path.time_s))
    velocity_n = rotate(rot_ne_at(lat, lon), curve(path.time_s, 1))
    lon += 2.0 * np.pi * np.round((path.lon_rad - lon) / (2.0 * np.pi))
    return replace(path, lat_rad=lat, lon_rad=lon, alt_m=alt, velocity_n=velocity_n)


def whittaker(values: np.ndarray, weight: float) -> np.ndarray:
    """Smooth rows (n, c) by a weight on their squared third differences."""
    count = len(values)
    third = np.zeros((count - 3, 4)) + np.array([-1.0, 3.0, -3.0, 1.0])
    band = np.zeros((4, count))
    band[3] = 1.0
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), j : j + count - 3] += weight * third[:, i] * third[:, j]
    return solveh_banded(band, values)
