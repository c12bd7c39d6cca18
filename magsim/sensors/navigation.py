"""Inertial navigation, and the true motion in the same columns.

Rows are instants: attitude, velocity and position are read at the row's time, not filtered. The errors of each
channel are a constant bias (attitude alone), a Gauss-Markov drift and white noise from row to row; they are added to
roll, pitch and heading themselves.
"""

from collections.abc import Mapping

import numpy as np

from magsim import columns
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.frames import rotate_back, wrap_pi
from magsim.scenario import Ins
from magsim.signals import gauss_markov
from magsim.streams import stream
from magsim.trajectory import Trajectory


def compass(angle_deg: np.ndarray) -> np.ndarray:
    """Bring headings [deg] into [0, 360)."""
    wrapped = np.mod(angle_deg, 360.0)
    # Just below zero the remainder rounds up to a whole turn.
    return np.where(wrapped >= 360.0, 0.0, wrapped)


Families = tuple[columns.Family, columns.Family, columns.Family]
"""Of attitude and position, velocity, height."""


def _motion_columns(
    families: Families,
    attitude_deg: np.ndarray,
    position: tuple[np.ndarray, np.ndarray, np.ndarray],
    velocity_n: np.ndarray,
) -> dict[str, np.ndarray]:
    """Columns from attitude (n, 3) [deg], latitude and longitude [rad] with height [m], velocity (n, 3) [m/s]."""
    angle, velocity, altitude = families
    lat_rad, lon_rad, alt_m = position
    roll, pitch, heading = attitude_deg.T
    angles = (roll, pitch, compass(heading), np.degrees(lat_rad), np.degrees(wrap_pi(lon_rad)))
    out = {angle.name(angle=name): value for name, value in zip(columns.INS_ANGLES, angles, strict=True)}
    out |= {velocity.name(direction=name): velocity_n[:, k] for k, name in enumerate(columns.DIRECTIONS)}
    return out | {altitude.name(): alt_m}


def true_columns(path: Trajectory) -> dict[str, np.ndarray]:
    """True motion of the reference point at the rows of a trajectory.

    Parameters
    ----------
    path : Trajectory
        At the times of the rows.

    Returns
    -------
    dict of str to (n,)
        Attitude, latitude, longitude [deg], angular rate [deg/s], velocity [m/s], height [m].
    """
    families = (columns.TRUE_ATTITUDE, columns.TRUE_VELOCITY, columns.TRUE_ALTITUDE)
    return _true_columns(families, columns.TRUE_RATE, path)


def carrier_columns(path: Trajectory) -> dict[str, np.ndarray]:
    """The same of the carrier of a bird, under names of its own."""
    families = (columns.TRUE_CARRIER_ATTITUDE, columns.TRUE_CARRIER_VELOCITY, columns.TRUE_CARRIER_ALTITUDE)
    return _true_columns(families, columns.TRUE_CARRIER_RATE, path)


def _true_columns(families: Families, rate: columns.Family, path: Trajectory) -> dict[str, np.ndarray]:
    position = (path.lat_rad, path.lon_rad, path.alt_m)
    out = _motion_columns(families, np.degrees(path.attitude), position, path.velocity_n)
    rates = np.degrees(path.rate_b)
    return out | {rate.name(axis=axis): rates[:, k] for k, axis in enumerate(columns.AXES)}


def rope_columns(rope: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Angles [deg] and tension [N] of the rope, as ``Flight.rope_at`` gives them."""
    angles = {columns.TRUE_ROPE_ANGLE.name(way=way): np.degrees(rope[f"{way}_rad"]) for way in columns.ROPE_WAYS}
    return angles | {columns.TRUE_ROPE_TENSION.name(): rope["tension_n"]}


def ins_columns(ins: Ins, path: Trajectory, rate_hz: float, seed: int) -> dict[str, np.ndarray]:
    """What the INS says at the rows of a trajectory.

    Parameters
    ----------
    ins : Ins
    path : Trajectory
        At the times of the rows.
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


def carrier_ins_columns(ins: Ins, path: Trajectory, rate_hz: float, seed: int) -> dict[str, np.ndarray]:
    """The same of a second INS in the carrier of a bird."""
    families = (columns.CARRIER_ATTITUDE, columns.CARRIER_VELOCITY, columns.CARRIER_ALTITUDE)
    return _ins_columns(families, "carrier_ins", ins, path, rate_hz, seed=seed)


def _ins_columns(
    families: Families, unit: str, ins: Ins, path: Trajectory, rate_hz: float, *, seed: int
) -> dict[str, np.ndarray]:
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
    return _motion_columns(families, attitude, position, path.velocity_n + velocity)
