"""The tow point: its motion through air and gravity, along Earth-fixed axes."""

import math
from collections.abc import Iterator
from itertools import islice

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.earth.atmosphere import standard_density
from magsim.earth.gravity import SPIN_RADPS, gravity_n
from magsim.frames import rot_nb_from_attitude, rotate, rotate_back
from magsim.scenario import Gusts
from magsim.streams import stream
from magsim.trajectory import Trajectory

EARTH_SPIN_E = (0.0, 0.0, SPIN_RADPS)

GUST_HZ = 10.0
"""Gusts are drawn on a grid of their own, so that the step rate does not change them."""


def gust_knots(gusts: Gusts, airspeed_mps: float, seed: int) -> Iterator[np.ndarray]:
    """Draw gusts at the bird knot by knot, (3,) [m/s] north, east, down: a Gauss-Markov process on each axis.

    Parameters
    ----------
    gusts : Gusts
    airspeed_mps : float
        The length scale over it is the correlation time.
    seed : int
    """
    keep = math.exp(-max(airspeed_mps, 1.0) / (gusts.length_m * GUST_HZ))
    drive = gusts.speed_mps * math.sqrt(1.0 - keep**2)
    rng = stream(seed, "tow/gusts")
    state = gusts.speed_mps * rng.standard_normal(3)
    while True:
        yield state
        state = keep * state + drive * rng.standard_normal(3)


def gusts_n(gusts: Gusts, time_s: np.ndarray, begun_s: float, airspeed_mps: float, seed: int) -> np.ndarray:
    """Return gusts at given times, linear between the knots, (n, 3) [m/s] north, east, down.

    Parameters
    ----------
    gusts : Gusts
    time_s : (n,) [s]
    begun_s : float [s]
        Time of the first knot, at or before the first time.
    airspeed_mps : float
    seed : int
    """
    since = time_s - begun_s
    count = math.ceil(since[-1] * GUST_HZ) + 1
    drawn = np.array(list(islice(gust_knots(gusts, airspeed_mps, seed), count)))
    knots = np.arange(count) / GUST_HZ
    return np.column_stack([np.interp(since, knots, drawn[:, k]) for k in range(3)])


class Hook:
    """The motion of a tow point as input of the equations of the chain.

    Its place is a cubic spline through the rows of the carrier's log; velocity and acceleration are its derivatives.
    Wind and gusts are linear between the rows.

    Parameters
    ----------
    carrier : Trajectory
    hook_b : (3,) [m]
        Of the rope, carrier axes from the datum.
    wind_n, gust_n : (n, 3) [m/s]
        Motion of the air at the carrier's rows, and the gust that is added to it at the bird.
    """

    def __init__(self, carrier: Trajectory, hook_b: np.ndarray, wind_n: np.ndarray, gust_n: np.ndarray) -> None:
        rot_ne, rot_nb = rot_ne_at(carrier.lat_rad, carrier.lon_rad), rot_nb_from_attitude(carrier.attitude)
        center_e = ecef_from_geodetic(carrier.lat_rad, carrier.lon_rad, carrier.alt_m)
        arm_n = rotate(rot_nb, np.asarray(hook_b) - carrier.reference_b)
        self.time_s = carrier.time_s
        self.origin_e = center_e[0]
        self._place = CubicSpline(self.time_s, center_e + rotate_back(rot_ne, arm_n) - self.origin_e)
        gravity_e = rotate_back(rot_ne, gravity_n(carrier.lat_rad, carrier.alt_m))
        self._gravity = CubicSpline(self.time_s, gravity_e)
        wind_e = rotate_back(rot_ne, wind_n)
        density = standard_density(carrier.alt_m)
        self._rows = np.column_stack([wind_e, wind_e + rotate_back(rot_ne, gust_n), density])

    def place_e(self, time_s: np.ndarray) -> np.ndarray:
        """Return the Earth-fixed place, (n, 3) [m]."""
        return self.origin_e + self._place(time_s)

    def velocity_e(self, time_s: np.ndarray) -> np.ndarray:
        """Return the velocity over ground along Earth-fixed axes, (n, 3) [m/s]."""
        return self._place(time_s, 1)

    def calm(self, time_s: float) -> np.ndarray:
        """Return the forcing of a chain below an unaccelerated hook without gusts, (10,): see ``dynamics``."""
        out = self.air(np.array([time_s]))[0]
        out[:3] += self._place(time_s, 2)
        out[6:9] = out[3:6]
        return out

    def air(self, time_s: np.ndarray) -> np.ndarray:
        """Return the forcing of a chain at given times, (n, 10): see ``dynamics``."""
        velocity = self._place(time_s, 1)
        coriolis = 2.0 * SPIN_RADPS * np.column_stack([-velocity[:, 1], velocity[:, 0], np.zeros(len(velocity))])
        out = np.empty((len(time_s), 10))
        out[:, :3] = self._gravity(time_s) - self._place(time_s, 2) - coriolis
        for k in range(7):
            out[:, 3 + k] = np.interp(time_s, self.time_s, self._rows[:, k])
        out[:, 3:6] -= velocity
        out[:, 6:9] -= velocity
        return out
