"""Inertial navigation: attitude, position and velocity that the INS computes.

Rows are instants: attitude, velocity and position are read at the row's time, not filtered. Position and velocity are
those of the place of the INS. The errors of each channel are a constant bias (attitude alone), a Gauss-Markov drift and
white noise from row to row; they are added to roll, pitch and heading themselves. Heading has one more, which follows
the maneuvers.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from magsim import columns
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.frames import rotate_back
from magsim.scenario import Ins
from magsim.sensors.inertial import placed
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.true_motion import Families, motion_columns
from magsim.signals import first_order_lag, gauss_markov
from magsim.streams import stream
from magsim.trajectory import Trajectory


def maneuver_error(ins: Ins, log: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Return the error of heading that follows the maneuvers.

    Scale errors and angles between the gyros make every turn a little heading, which the aiding takes back:
    ``de/dt = coupling . w - e / recovery`` with the rate ``w`` of the body, from 0 at the beginning of the log.

    Parameters
    ----------
    ins : Ins
    log : Trajectory
    time_s : (m,) [s]
        Inside the log.

    Returns
    -------
    (m,) [deg]
    """
    driven = ins.heading_recovery_s * (np.degrees(log.rate_b) @ np.array(ins.heading_coupling))
    settled = first_order_lag(driven, ins.heading_recovery_s, log.rate_hz)
    error = settled - driven[0] * np.exp(-(log.time_s - log.time_s[0]) / ins.heading_recovery_s)
    return CubicSpline(log.time_s, error)(time_s)


def ins_columns(ins: Ins, path: Trajectory, rate_hz: float, seed: int, log: Trajectory | None = None) -> Columns:
    """Return the output of the INS at the rows of a trajectory.

    Parameters
    ----------
    ins : Ins
    path : Trajectory
        The motion at the instants of the rows, of the place that the INS takes itself to be at.
    rate_hz : float [Hz]
        Rows a second.
    seed : int
    log : Trajectory, optional
        The motion with all its rows, for the error that follows the maneuvers; the path if left out.

    Returns
    -------
    dict of str to (n,)
        Attitude, latitude, longitude [deg], velocity [m/s], height [m].
    """
    families = (columns.INS_ATTITUDE, columns.INS_VELOCITY, columns.INS_ALTITUDE)
    return _ins_columns(families, "ins", ins, path, rate_hz, seed=seed, log=log)


def carrier_ins_columns(
    ins: Ins, path: Trajectory, rate_hz: float, seed: int, log: Trajectory | None = None
) -> Columns:
    """Return the same as ``ins_columns`` for a second INS in the carrier of a bird."""
    families = (columns.CARRIER_ATTITUDE, columns.CARRIER_VELOCITY, columns.CARRIER_ALTITUDE)
    return _ins_columns(families, "carrier_ins", ins, path, rate_hz, seed=seed, log=log)


def _ins_columns(
    families: Families,
    unit: str,
    ins: Ins,
    path: Trajectory,
    rate_hz: float,
    *,
    seed: int,
    log: Trajectory | None,
) -> Columns:
    shape = (len(path), 3)

    def errors(name: str, drift: float, noise: float) -> np.ndarray:
        slow = gauss_markov(stream(seed, f"{unit}/{name}/drift"), shape, drift, ins.correlation_s, rate_hz)
        return slow + noise * stream(seed, f"{unit}/{name}/noise").standard_normal(shape)

    attitude = errors("attitude", ins.attitude_drift_deg, ins.attitude_noise_deg)
    attitude[:, 2] *= ins.heading_factor
    attitude += np.degrees(path.attitude) + np.array(ins.attitude_bias_deg)
    if any(ins.heading_coupling):
        attitude[:, 2] += maneuver_error(ins, path if log is None else log, path.time_s)
    off_n = errors("position", ins.position_drift_m, ins.position_noise_m)
    off_e = rotate_back(rot_ne_at(path.lat_rad, path.lon_rad), off_n)
    position = geodetic_from_ecef(ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m) + off_e)
    velocity = errors("velocity", ins.velocity_drift_mps, ins.velocity_noise_mps)
    return motion_columns(families, attitude, position, path.velocity_n + velocity)


def read_ins(flight: MeasuredFlight) -> Columns:
    """Return the output of the INS in the body that is surveyed with."""
    ins = flight.sensors.ins
    return ins_columns(ins, _read_path(flight, ins, "ins", flight.log), flight.rate_hz, flight.seed, flight.log)


def read_carrier_ins(flight: MeasuredFlight) -> Columns:
    """Return the output of the INS in the carrier of a bird; none where the scenario names none."""
    ins = flight.sensors.carrier_ins
    if ins is None:
        return {}
    log = flight.flight.carrier
    path = _read_path(flight, ins, "carrier_ins", log)
    return carrier_ins_columns(ins, path, flight.rate_hz, flight.seed, log)


def _read_path(flight: MeasuredFlight, ins: Ins, name: str, log: Trajectory) -> Trajectory:
    """Return the motion of where an INS takes itself to be, at the instants of its rows."""
    there = placed(ins, log)
    if any(ins.lever_error_m):
        there = there.moved_to(there.reference_b + np.array(ins.lever_error_m))
    path = flight.path if there is flight.log else there.at(flight.time_s)
    return flight.motion_read(ins, name, there, path)
