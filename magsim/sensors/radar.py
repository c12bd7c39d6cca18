"""The radar altimeter, and the true heights above ground and sea.

The altimeter hears the ground straight below: within its beam a radar tracks the nearest echo, and over the gentle
ground of a survey that is the one below. Beyond its range or its tilt it says ``NO_ECHO``, a height that no aircraft
has, because a recording holds no NaN.
"""

import numpy as np

from magsim import columns
from magsim.scenario import Radar
from magsim.streams import stream
from magsim.terrain import Ground
from magsim.trajectory import Trajectory

NO_ECHO = -1.0
"""Reading without an echo [m]."""


def ground_columns(path: Trajectory, ground: Ground) -> dict[str, np.ndarray]:
    """True heights above the sea and the ground at the rows of a trajectory, (n,) each [m].

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


def radar_columns(radar: Radar, path: Trajectory, ground: Ground, seed: int) -> dict[str, np.ndarray]:
    """What the radar altimeter says at the rows of a trajectory.

    Parameters
    ----------
    radar : Radar
    path : Trajectory
        At the times of the rows.
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
    heard = (height <= radar.max_range_m) & (upright >= np.cos(np.radians(radar.max_tilt_deg)))
    # A reading is never negative: on the ground the noise would else be taken for the mark.
    return {columns.RADAR.name(): np.where(heard, np.maximum(reading, 0.0), NO_ECHO)}
