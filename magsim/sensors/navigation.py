"""Inertial navigation: attitude, position and velocity that the INS computes.

Rows are instants: attitude, velocity and position are read at the row's time, not filtered. The errors of each
channel are a constant bias (attitude alone), a Gauss-Markov drift and white noise from row to row; they are added to
roll, pitch and heading themselves.
"""

import numpy as np

from magsim import columns
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.frames import rotate_back
from magsim.scenario import Ins
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.true_motion import Families, motion_columns
from magsim.signals import gauss_markov
from magsim.streams import stream
from magsim.trajectory import Trajectory


def ins_columns(ins: Ins, path: Trajectory, rate_hz: float, seed: int) -> Columns:
    """Return the output of the INS at the rows of a trajectory.

    Parameters
    ----------
    ins : Ins
    path : Trajectory
        The motion at the times of the rows.
    rate_hz : float [Hz]
        Rows a second.
    seed : int

    Returns
    -------
    dict of str to (n,)
        Attitude, latitude, longitude [deg], velocity [m/s], height [m].
    """
    families = (columns.INS_ATTITUDE, columns.INS_VELOCITY, columns.INS_ALTITUDE)
    return _ins_columns(families, "ins", ins, path, rate_hz, seed=seed)


def carrier_ins_columns(ins: Ins, path: Trajectory, rate_hz: float, seed: int) -> Columns:
    """Return the same as ``ins_columns`` for a second INS in the carrier of a bird."""
    families = (columns.CARRIER_ATTITUDE, columns.CARRIER_VELOCITY, columns.CARRIER_ALTITUDE)
    return _ins_columns(families, "carrier_ins", ins, path, rate_hz, seed=seed)


def _ins_columns(families: Families, unit: str, ins: Ins, path: Trajectory, rate_hz: float, *, seed: int) -> Columns:
    shape = (len(path), 3)

    def errors(name: str, drift: float, noise: float) -> np.ndarray:
        slow = gauss_markov(stream(seed, f"{unit}/{name}/drift"), shape, drift, ins.correlation_s, rate_hz)
        return slow + noise * stream(seed, f"{unit}/{name}/noise").standard_normal(shape)

    attitude = errors("attitude", ins.attitude_drift_deg, ins.attitude_noise_deg)
    attitude[:, 2] *= ins.heading_factor
    attitude += np.degrees(path.attitude) + np.array(ins.attitude_bias_deg)
    off_n = errors("position", ins.position_drift_m, ins.position_noise_m)
    off_e = rotate_back(rot_ne_at(path.lat_rad, path.lon_rad), off_n)
    position = geodetic_from_ecef(ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m) + off_e)
    velocity = errors("velocity", ins.velocity_drift_mps, ins.velocity_noise_mps)
    return motion_columns(families, attitude, position, path.velocity_n + velocity)


def read_ins(flight: MeasuredFlight) -> Columns:
    """Return the output of the INS in the body that is surveyed with."""
    ins = flight.sensors.ins
    return ins_columns(ins, flight.path_read(ins, "ins"), flight.rate_hz, flight.seed)


def read_carrier_ins(flight: MeasuredFlight) -> Columns:
    """Return the output of the INS in the carrier of a bird; none where the scenario names none."""
    ins = flight.sensors.carrier_ins
    if ins is None:
        return {}
    log = flight.flight.carrier
    path = flight.motion_read(ins, "carrier_ins", log, log.at(flight.time_s))
    return carrier_ins_columns(ins, path, flight.rate_hz, flight.seed)
