"""The barometer: static pressure, and the height that the standard atmosphere gives it.

The day's pressure at a height is that of the standard atmosphere at another one: that by which the sea-level pressure
of the day, the QNH, differs. So an altimeter that is set to the QNH reads the geopotential height above the sea.
``pressure = step(lag(true) + offset + drift + noise)``.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from magsim import columns
from magsim.earth.atmosphere import geopotential_height, pressure_altitude, standard_pressure
from magsim.scenario import Barometer
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import white_noise
from magsim.signals import first_order_lag, gauss_markov
from magsim.streams import stream
from magsim.terrain import Ground
from magsim.trajectory import Trajectory


def static_pressure(path: Trajectory, ground: Ground | None, qnh_pa: float) -> np.ndarray:
    """Return the pressure of the air around the reference point, (n,) [Pa].

    Parameters
    ----------
    path : Trajectory
    ground : Ground, optional
        Gives the height of the sea; without it, the sea is the ellipsoid.
    qnh_pa : float [Pa]
        Sea-level pressure of the day.
    """
    height_m = path.alt_m if ground is None else ground.above_sea(path.alt_m)
    return standard_pressure(geopotential_height(height_m) + pressure_altitude(qnh_pa))


def baro_columns(
    barometer: Barometer,
    log: Trajectory,
    path: Trajectory,
    *,
    ground: Ground | None,
    rate_hz: float,
    seed: int,
) -> Columns:
    """Return the readings of the barometer at the rows of a trajectory.

    Parameters
    ----------
    barometer : Barometer
    log : Trajectory
        The motion with all its rows, from some seconds before the first row: the lag looks back.
    path : Trajectory
        The motion at the instants of the readings.
    ground : Ground, optional
    rate_hz : float [Hz]
        Rows a second.
    seed : int

    Returns
    -------
    dict of str to (n,)
        Height [m] and pressure [Pa].
    """
    if barometer.lag_s > 0.0:
        lagged = first_order_lag(static_pressure(log, ground, barometer.qnh_pa), barometer.lag_s, log.rate_hz)
        pressure = CubicSpline(log.time_s, lagged)(path.time_s)
    else:
        pressure = static_pressure(path, ground, barometer.qnh_pa)
    shape = (len(path),)
    drift = gauss_markov(stream(seed, "baro/drift"), shape, barometer.drift_pa, barometer.correlation_s, rate_hz)
    noise = white_noise(stream(seed, "baro/noise"), shape, barometer.noise_pa_rthz, rate_hz)
    pressure = pressure + barometer.offset_pa + drift + noise
    if barometer.step_pa > 0.0:
        pressure = barometer.step_pa * np.round(pressure / barometer.step_pa)
    return {
        columns.BARO_ALTITUDE.name(): pressure_altitude(pressure) - pressure_altitude(barometer.setting_pa),
        columns.BARO_PRESSURE.name(): pressure,
    }


def true_baro_columns(barometer: Barometer, path: Trajectory, ground: Ground | None) -> Columns:
    """Return the true pressure at the rows of a trajectory, (n,) [Pa]."""
    return {columns.TRUE_PRESSURE.name(): static_pressure(path, ground, barometer.qnh_pa)}


def read(flight: MeasuredFlight) -> Columns:
    """Return the readings of the barometer, and the true pressure; none without one."""
    barometer = flight.sensors.barometer
    if barometer is None:
        return {}
    ground, path = flight.ground, flight.path_read(barometer, "baro")
    readings = baro_columns(barometer, flight.log, path, ground=ground, rate_hz=flight.rate_hz, seed=flight.seed)
    return readings | true_baro_columns(barometer, flight.path, ground)
