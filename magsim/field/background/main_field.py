"""The Earth's main field along a flight, at each sensor's own place."""

from collections.abc import Callable
from datetime import timedelta

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import decimal_year, decimal_years, igrf
from magsim.earth.igrf import field_of_model, igrf14
from magsim.errors import DataError
from magsim.field.background.path import BodyPlaces
from magsim.field.kernels import expanded_in_body
from magsim.field.situation import Passage
from magsim.frames import rotate_back
from magsim.scenario import Scenario
from magsim.trajectory import Trajectory

KNOT_HZ = 8.0
"""Rate at which the Earth's field is evaluated along the path; a cubic spline joins the knots.

At 75 m/s a knot every 10 m: the field follows the path, 0.02 nT a meter, not the attitude.
"""


def years_of(scenario: Scenario, time_s: np.ndarray) -> np.ndarray:
    """Return the decimal years of times counted from row 0, (n,).

    Raises
    ------
    DataError
        If the flight, with the run-in of the filters at both ends, leaves the years of IGRF-14.
    """
    start = scenario.start.time_utc
    year, epochs = decimal_years(start, time_s), igrf14().epochs
    for value, over, what in ((year[0], year[0] < epochs[0], "begins"), (year[-1], year[-1] > epochs[-1], "ends")):
        if over:
            at = start + timedelta(seconds=float(time_s[0] if what == "begins" else time_s[-1]))
            msg = (
                f"start.time_utc: the flight {what} at {at:%Y-%m-%d %H:%M:%S} UTC, decimal year {value:.6f}, run-in of "
                f"filters included; allowed: IGRF-14 covers {epochs[0]:g} to {epochs[-1]:g}"
            )
            raise DataError(msg)
    return year


def earth_along(scenario: Scenario, path: Trajectory, time_s: np.ndarray) -> CubicSpline:
    """Return IGRF-14 along a path with its gradient, on cubic splines through few knots of place and time.

    Parameters
    ----------
    scenario : Scenario
        Gives the time of row 0.
    path : Trajectory
    time_s : (n,) [s]
        From the first to the last of these.

    Returns
    -------
    CubicSpline
        (9,) at each time: field [nT] and the gradient's entries in the order of ``harmonics.PAIRS`` [nT/m], Earth-fixed
        axes. The gradient has no curl: six numbers hold it.
    """
    knots = knots_along(time_s)
    year = years_of(scenario, knots)
    return CubicSpline(knots, field_of_model(path.motion_e_at(knots)[0], year, igrf14(), gradient=True))


def knots_along(time_s: np.ndarray) -> np.ndarray:
    """Return evenly spaced knots from the first to the last sample, (k,) [s]."""
    return np.linspace(time_s[0], time_s[-1], max(8, int(np.ceil((time_s[-1] - time_s[0]) * KNOT_HZ)) + 1))


def earth_at_start(scenario: Scenario) -> np.ndarray:
    """Return IGRF-14 at the start point and time, (3,) [nT] north, east, down."""
    start = scenario.start
    place = np.radians([start.lat_deg]), np.radians([start.lon_deg]), np.array([start.alt_m])
    return igrf(*place, np.array([decimal_year(start.time_utc)]))[0]


def earth(passage: Passage) -> Callable[[BodyPlaces], np.ndarray]:
    """Return the main field in body axes, by its gradient at each place, (p, n, 3) [nT]."""
    scenario = passage.scenario
    if not scenario.field.earth.along_path:
        field_b = rotate_back(passage.rot_nb, earth_at_start(scenario))
        return lambda places: np.broadcast_to(field_b, (len(places.arms_b), *field_b.shape))
    curve = earth_along(scenario, passage.path, passage.time_s)
    return lambda places: expanded_in_body(curve.c, curve.x, passage.time_s, passage.rot_be, places.arms_b)
