"""True motion of the flight and what surrounds it, in columns: carrier, rope, wind, ground.

Rows are instants: attitude, velocity and position are those of the row's time, not filtered.
"""

from collections.abc import Mapping

import numpy as np

from magsim import columns
from magsim.frames import wrap_pi
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.terrain import Ground
from magsim.trajectory import Trajectory

Families = tuple[columns.Family, columns.Family, columns.Family]
"""Families of columns: attitude and position, velocity, height."""


def compass(angle_deg: np.ndarray) -> np.ndarray:
    """Bring headings [deg] into [0, 360)."""
    wrapped = np.mod(angle_deg, 360.0)
    # Just below zero the remainder rounds up to a whole turn.
    return np.where(wrapped >= 360.0, 0.0, wrapped)


def motion_columns(
    families: Families,
    attitude_deg: np.ndarray,
    position: tuple[np.ndarray, np.ndarray, np.ndarray],
    velocity_n: np.ndarray,
) -> Columns:
    """Return the columns of a motion.

    Parameters
    ----------
    families : three of Family
        Those of attitude and position, velocity, height.
    attitude_deg : (n, 3) [deg]
        Roll, pitch, heading.
    position : three of (n,)
        Latitude and longitude [rad], height [m].
    velocity_n : (n, 3) [m/s]
        North, east, down.
    """
    angle, velocity, altitude = families
    lat_rad, lon_rad, alt_m = position
    roll, pitch, heading = attitude_deg.T
    angles = (roll, pitch, compass(heading), np.degrees(lat_rad), np.degrees(wrap_pi(lon_rad)))
    out = {angle.name(angle=name): value for name, value in zip(columns.INS_ANGLES, angles, strict=True)}
    out |= {velocity.name(direction=name): velocity_n[:, k] for k, name in enumerate(columns.DIRECTIONS)}
    return out | {altitude.name(): alt_m}


def true_columns(path: Trajectory) -> Columns:
    """Return the true motion of the reference point at the rows of a trajectory.

    Parameters
    ----------
    path : Trajectory
        The motion at the times of the rows.

    Returns
    -------
    dict of str to (n,)
        Attitude, latitude, longitude [deg], angular rate [deg/s], velocity [m/s], height [m].
    """
    families = (columns.TRUE_ATTITUDE, columns.TRUE_VELOCITY, columns.TRUE_ALTITUDE)
    return _true_columns(families, columns.TRUE_RATE, path)


def carrier_columns(path: Trajectory) -> Columns:
    """Return the same as ``true_columns`` for the carrier of a bird, under names of its own."""
    families = (columns.TRUE_CARRIER_ATTITUDE, columns.TRUE_CARRIER_VELOCITY, columns.TRUE_CARRIER_ALTITUDE)
    return _true_columns(families, columns.TRUE_CARRIER_RATE, path)


def _true_columns(families: Families, rate: columns.Family, path: Trajectory) -> Columns:
    position = (path.lat_rad, path.lon_rad, path.alt_m)
    out = motion_columns(families, np.degrees(path.attitude), position, path.velocity_n)
    rates = np.degrees(path.rate_b)
    return out | {rate.name(axis=axis): rates[:, k] for k, axis in enumerate(columns.AXES)}


def rope_columns(rope: Mapping[str, np.ndarray]) -> Columns:
    """Return angles [deg] and tension [N] of the rope from those of ``Flight.rope_at``."""
    angles = {columns.TRUE_ROPE_ANGLE.name(way=way): np.degrees(rope[f"{way}_rad"]) for way in columns.ROPE_WAYS}
    return angles | {columns.TRUE_ROPE_TENSION.name(): rope["tension_n"]}


def ground_columns(path: Trajectory, ground: Ground) -> Columns:
    """Return true heights above the sea and the ground at the rows of a trajectory, (n,) each [m].

    Raises
    ------
    DataError
        If the flight leaves a terrain grid.
    """
    below = ground.height(path.lat_rad, path.lon_rad)
    return {
        columns.TRUE_MSL.name(): ground.above_sea(path.alt_m),
        columns.TRUE_AGL.name(): path.alt_m - below,
        columns.TRUE_GROUND.name(): below,
    }


def read_motion(flight: MeasuredFlight) -> Columns:
    """Return the true motion of the body that is surveyed with."""
    return true_columns(flight.path)


def read_tow(flight: MeasuredFlight) -> Columns:
    """Return the true motion of the carrier beside its bird, and that of the rope between them; none without a bird."""
    if flight.flight.bird is None:
        return {}
    carrier = flight.flight.carrier.at(flight.time_s)
    return carrier_columns(carrier) | rope_columns(flight.flight.rope_at(flight.time_s))


def read_ground(flight: MeasuredFlight) -> Columns:
    """Return the true heights above sea and ground; none without terrain."""
    return {} if flight.ground is None else ground_columns(flight.path, flight.ground)


def read_wind(flight: MeasuredFlight) -> Columns:
    """Return the true wind, (rows,) each [m/s]; none where it is not known."""
    wind_n = flight.flight.wind_at(flight.time_s)
    if wind_n is None:
        return {}
    return {columns.TRUE_WIND.name(direction=name): wind_n[:, k] for k, name in enumerate(columns.DIRECTIONS)}
