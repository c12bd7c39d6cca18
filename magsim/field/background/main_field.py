"""The Earth's main field along a flight, at each sensor's own place."""

from datetime import timedelta

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.earth import decimal_year, decimal_years, igrf
from magsim.earth.grid import grid_turn_of, rot_level
from magsim.earth.igrf import igrf14
from magsim.errors import DataError
from magsim.field.situation import Situation
from magsim.frames import rotate, rotate_back
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


def earth_along(
    scenario: Scenario, carrier: Trajectory, time_s: np.ndarray, *, knot_hz: float = KNOT_HZ
) -> tuple[np.ndarray, np.ndarray]:
    """Return IGRF-14 at the carrier's reference point, by cubic splines through few knots of place and time.

    Parameters
    ----------
    scenario : Scenario
        Gives the time of row 0.
    carrier : Trajectory
    time_s : (n,) [s]
    knot_hz : float
        Knots per second.

    Returns
    -------
    field_n : (n, 3) [nT]
        North, east, down.
    gradient_n : (n, 3, 3) [nT/m]
    """
    count = max(8, int(np.ceil((time_s[-1] - time_s[0]) * knot_hz)) + 1)
    knots = np.linspace(time_s[0], time_s[-1], count)
    path = carrier.at(knots)
    year = years_of(scenario, knots)
    field, gradient = igrf(path.lat_rad, path.lon_rad, path.alt_m, year, gradient=True)
    grid = grid_turn_of(path.lat_rad)
    if grid:
        field, gradient = _turned(grid * path.lon_rad, field, gradient)
    # The gradient has no curl: six numbers hold it.
    rows, columns = np.triu_indices(3)
    table = CubicSpline(knots, np.column_stack([field, gradient[:, rows, columns]]))(time_s)
    full = np.empty((len(time_s), 3, 3))
    full[:, rows, columns] = full[:, columns, rows] = table[:, 3:]
    if grid:
        return _turned(-grid * carrier.at(time_s).lon_rad, table[:, :3], full)
    return table[:, :3], full


def _turned(angle_rad: np.ndarray, field_n: np.ndarray, gradient_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return field and gradient in horizontal directions turned clockwise: grid directions near the poles."""
    rot = rot_level(angle_rad)
    return rotate(rot, field_n), np.einsum("nij,njk,nlk->nil", rot, gradient_n, rot)


def earth_at_start(scenario: Scenario) -> np.ndarray:
    """Return IGRF-14 at the start point and time, (3,) [nT] north, east, down."""
    start = scenario.start
    place = np.radians([start.lat_deg]), np.radians([start.lon_deg]), np.array([start.alt_m])
    return igrf(*place, np.array([decimal_year(start.time_utc)]))[0]


def earth(situation: Situation) -> np.ndarray:
    """Return the main field in body axes, by its gradient at each mount, (n, s + 1, 3) [nT]."""
    scenario, rot_nb, arms_b = situation.scenario, situation.rot_nb, situation.arms_b
    if not scenario.field.earth.along_path:
        field_b = rotate_back(rot_nb, earth_at_start(scenario))
        return np.repeat(field_b[:, None, :], len(arms_b), axis=1)
    field_n, gradient_n = earth_along(scenario, situation.flight.carrier, situation.time_s)
    out = np.empty((len(field_n), len(arms_b), 3))
    out[:, -1] = rotate_back(rot_nb, field_n)
    for s, arm_b in enumerate(arms_b[:-1]):
        arm_n = np.einsum("nij,j->ni", rot_nb, arm_b)
        out[:, s] = out[:, -1] + rotate_back(rot_nb, np.einsum("nij,nj->ni", gradient_n, arm_n))
    return out
