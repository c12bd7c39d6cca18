"""A field of the Earth along the paths of all mounts: evaluated at few knots, joined by cubic splines.

Each mount is followed on its own path, rotation included; nothing is expanded about the reference point. The knots
lie as close as the field demands at each place.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import ecef_from_geodetic, rot_ne_at
from magsim.field.situation import Situation
from magsim.frames import rot_nb_from_attitude, rotate
from magsim.trajectory import Trajectory

TOLERANCE_NT = 3e-6
"""What the spline between the knots may miss [nT], by bounds that are some times larger than what it does miss."""

SWING_RAD_S4 = 30.0
"""Fourth time derivative of an attitude in turbulence: half a degree at 1.2 Hz (estimate)."""

LEAST_HZ = 10.0
"""Fewest knots a second."""

SURVEY_HZ = 10.0
"""Rate at which a path is sampled before knots are set."""


@dataclass(frozen=True)
class Knots:
    """A path sampled for the spacing of knots.

    Attributes
    ----------
    time_s : (n,) [s]
    center_e : (n, 3) [m]
        Earth-fixed position of the reference point.
    speed_mps : (n,) [m/s]
        Over ground.
    """

    time_s: np.ndarray
    center_e: np.ndarray
    speed_mps: np.ndarray


FieldE = Callable[[np.ndarray], np.ndarray]
"""Field (m, 3) [nT] at positions (m, 3) [m], both along Earth-fixed axes."""

Bounds = Callable[[Knots], tuple[np.ndarray, np.ndarray]]
"""Bounds of the field's first and fourth derivative along any line at each place, (n,) [nT/m] and [nT/m^4]."""


def positions_along(path: Trajectory, arms_b: np.ndarray) -> np.ndarray:
    """Return the Earth-fixed positions of points of a body, (n, s, 3) [m].

    Parameters
    ----------
    path : Trajectory
        With n rows.
    arms_b : (s, 3) [m]
        From the reference point, body axes.
    """
    rot_nb, rot_ne = rot_nb_from_attitude(path.attitude), rot_ne_at(path.lat_rad, path.lon_rad)
    rot_be = np.einsum("nij,nik->njk", rot_nb, rot_ne)
    center_e = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    return center_e[:, None, :] + np.einsum("njk,sj->nsk", rot_be, arms_b)


def longest(arms_b: np.ndarray) -> float:
    """Return the length of the longest of some arms [m]."""
    return float(np.sqrt(np.einsum("si,si->s", arms_b, arms_b)).max())


def sampled(path: Trajectory) -> Knots:
    """Return what the spacing of knots is computed from."""
    center_e = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    return Knots(path.time_s, center_e, np.sqrt(np.einsum("ni,ni->n", path.velocity_n, path.velocity_n)))


def knots_of(carrier: Trajectory, arm_m: float, time_s: np.ndarray, bounds: Bounds) -> np.ndarray:
    """Return the times of the knots from the first to the last sample, (k,) [s].

    A cubic spline misses h^4 / 384 of the fourth time derivative. The path makes one of the speed, and a mount on an
    arm makes one of the swings of the attitude.
    """
    survey = np.linspace(time_s[0], time_s[-1], max(8, int((time_s[-1] - time_s[0]) * SURVEY_HZ)))
    sampled_path = sampled(carrier.at(survey))
    first, fourth = bounds(sampled_path)
    curved = fourth * sampled_path.speed_mps**4 + first * arm_m * SWING_RAD_S4
    rate = np.maximum((curved / (384.0 * TOLERANCE_NT)) ** 0.25, LEAST_HZ)
    # Between two samples the larger of both rates holds.
    steps = np.maximum(rate[1:], rate[:-1]) * np.diff(survey)
    count = np.concatenate([[0.0], np.cumsum(steps)])
    whole = max(8, int(np.ceil(count[-1])))
    return np.interp(np.linspace(0.0, count[-1], whole + 1), count, survey)


def along_path(
    carrier: Trajectory, arms_b: np.ndarray, time_s: np.ndarray, field_e: FieldE, bounds: Bounds
) -> np.ndarray:
    """Return a field at several points of a body along its path.

    Parameters
    ----------
    carrier : Trajectory
    arms_b : (s, 3) [m]
        Points of the body from its reference point, body axes.
    time_s : (n,) [s]
        Inside the carrier's log.
    field_e : callable
        The field at Earth-fixed positions.
    bounds : callable
        Of the field's derivatives.

    Returns
    -------
    (n, s, 3) [nT]
        Earth-fixed axes, which do not turn with the place as north does near a pole.
    """
    knots = knots_of(carrier, longest(arms_b), time_s, bounds)
    positions = positions_along(carrier.at(knots), arms_b)
    values = np.empty_like(positions)
    for s in range(len(arms_b)):
        values[:, s] = field_e(positions[:, s])
    return CubicSpline(knots, values)(time_s)


def in_body(situation: Situation, field_e: np.ndarray) -> np.ndarray:
    """Return Earth-fixed fields at the samples of a flight, (n, s, 3) [nT], in body axes."""
    rot_ne = rot_ne_at(situation.motion.lat_rad, situation.motion.lon_rad)
    rot_be = np.einsum("nij,nik->njk", situation.rot_nb, rot_ne)
    return rotate(rot_be[:, None], field_e)
