"""The radar altimeter: height above the ground straight below.

Within its beam a radar tracks the nearest echo, and over the gentle ground of a survey that is the one below. Beyond
its range or its tilt it reads ``NO_ECHO``, a height that no aircraft has, because a recording holds no NaN.
"""

import numpy as np

from magsim import columns
from magsim.scenario import Radar
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.streams import stream
from magsim.terrain import Ground
from magsim.trajectory import Trajectory

NO_ECHO = -1.0
"""Reading without an echo [m]."""


def radar_columns(radar: Radar, path: Trajectory, ground: Ground, seed: int) -> Columns:
    """Return the readings of the radar altimeter at the rows of a trajectory.

    Parameters
    ----------
    radar : Radar
    path : Trajectory
        The motion at the times of the rows.
    ground : Ground
    seed : int

    Returns
    -------
    dict of str to (n,)
        Height above ground [m]; ``NO_ECHO`` where the range or the tilt is too large.
    """
    height = path.alt_m - ground.height(path.lat_rad, path.lon_rad)
    random = stream(seed, "radar/noise")
    reading = height + radar.noise_m * random.standard_normal(len(path))
    reading += radar.noise_relative * height * random.standard_normal(len(path))
    upright = np.cos(path.attitude[:, 0]) * np.cos(path.attitude[:, 1])
    has_echo = (height <= radar.max_range_m) & (upright >= np.cos(np.radians(radar.max_tilt_deg)))
    # A reading is never negative: on the ground the noise could be mistaken for NO_ECHO.
    return {columns.RADAR.name(): np.where(has_echo, np.maximum(reading, 0.0), NO_ECHO)}


def read(flight: MeasuredFlight) -> Columns:
    """Return the readings of the radar altimeter; none without one, or without terrain."""
    radar = flight.sensors.radar
    if radar is None or flight.ground is None:
        return {}
    return radar_columns(radar, flight.path_read(radar, "radar"), flight.ground, flight.seed)
