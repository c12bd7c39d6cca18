"""Accelerometers and gyros of the INS: specific force and inertial rate at its place in the body, in body axes.

``reading = step(scale * true + bias + drift + noise)`` on each axis. Accelerometers do not sense gravity: at rest they
read 1 g upward. Gyros sense the rotation of the Earth: at rest they read 15 degrees an hour about its axis.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from magsim import columns
from magsim.earth import geodetic_from_ecef, rot_ne_at
from magsim.earth.gravity import SPIN_RADPS, gravity_n
from magsim.frames import rotate, rotate_back
from magsim.scenario import Ins
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.clocks import instants
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import white_noise
from magsim.signals import gauss_markov
from magsim.streams import stream
from magsim.trajectory import Trajectory
from magsim.units import G0

LEAST_FACTOR = 3
"""Fewest samples for each row: what the filter needs."""

LARGEST_MULTIPLE = 8
"""Most samples for each row of the log that are tried to meet the rows of the recording."""


def specific_force(log: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Return the readings of ideal accelerometers at the reference point.

    Parameters
    ----------
    log : Trajectory
        The derivative of its velocity is the acceleration.
    time_s : (m,) [s]

    Returns
    -------
    (m, 3) [m/s^2]
        Body axes: ``a_e + 2 w x v_e - g``, with the acceleration and velocity over the turning Earth and normal gravity
        (Groves, Principles of GNSS, eq. 5.35).
    """
    place_e, velocity_e = log.motion_e_at(time_s)
    _, acceleration_e = log.motion_e_at(time_s, order=1)
    lat, lon, alt = geodetic_from_ecef(place_e)
    gravity_e = rotate_back(rot_ne_at(lat, lon), gravity_n(lat, alt))
    force_e = acceleration_e + 2.0 * np.cross([0.0, 0.0, SPIN_RADPS], velocity_e) - gravity_e
    return rotate(log.rot_be_at(time_s), force_e)


def inertial_rate(log: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Return the readings of ideal gyros: the rate relative to the stars, body axes, (m, 3) [rad/s]."""
    return log.rate_eb_at(time_s) + SPIN_RADPS * log.rot_be_at(time_s)[:, :, 2]


def load_factor(log: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Return the load factor at the reference point, upward in body axes: 1 in level flight; (m,) [g].

    Parameters
    ----------
    log : Trajectory
    time_s : (m,) [s]
    """
    return -specific_force(log, time_s)[:, 2] / G0


def placed(ins: Ins, log: Trajectory) -> Trajectory:
    """Return the motion of the place of an INS; that of the reference point where its place is not given."""
    return log if ins.position_m is None else log.moved_to(np.array(ins.position_m))


@dataclass(frozen=True)
class Triad:
    """Errors of three accelerometers or three gyros.

    Attributes
    ----------
    bias : (x, y, z) [unit]
    scale_error : (x, y, z)
        Relative.
    drift : float [unit]
        Standard deviation of a Gauss-Markov process.
    correlation_s : float [s]
        Of the drift.
    noise : float [unit/sqrt(Hz)]
        White, one-sided density.
    step : float [unit]
        Least count; 0 for none.
    """

    bias: tuple[float, float, float]
    scale_error: tuple[float, float, float]
    drift: float
    correlation_s: float
    noise: float
    step: float

    def __call__(self, true: np.ndarray, rate_hz: float, name: str, seed: int) -> np.ndarray:
        """Return the readings of rows (n, 3) at a rate [Hz]; the name is that of the random streams."""
        drift = gauss_markov(stream(seed, f"{name}/drift"), true.shape, self.drift, self.correlation_s, rate_hz)
        noise = white_noise(stream(seed, f"{name}/noise"), true.shape, self.noise, rate_hz)
        reading = (1.0 + np.array(self.scale_error)) * true + np.array(self.bias) + drift + noise
        return reading if self.step == 0.0 else self.step * np.round(reading / self.step)


def accelerometers(ins: Ins) -> Triad:
    """Return the accelerometers of an INS [m/s^2]."""
    return Triad(
        ins.acc_bias_mps2,
        ins.acc_scale_error,
        ins.acc_drift_mps2,
        ins.acc_correlation_s,
        ins.acc_noise_mps2_rthz,
        ins.acc_step_mps2,
    )


def gyros(ins: Ins) -> Triad:
    """Return the gyros of an INS [deg/s]."""
    return Triad(
        ins.rate_bias_dps,
        ins.rate_scale_error,
        ins.rate_drift_dps,
        ins.rate_correlation_s,
        ins.rate_noise_dps_rthz,
        ins.rate_step_dps,
    )


def samples_of(log: Trajectory, rows: Acquisition) -> tuple[np.ndarray, Acquisition]:
    """Return specific force [m/s^2] and inertial rate [deg/s] at samples, (n, 6), and their acquisition.

    The samples are a multiple of the log's rows: at other rates a curve through rows that shake would fold.
    """
    ratio = Fraction(log.rate_hz / rows.rate_out_hz).limit_denominator(LARGEST_MULTIPLE)
    factor = ratio.numerator * math.ceil(LEAST_FACTOR / ratio.numerator)
    rate_hz = factor * rows.rate_out_hz
    first, last = math.ceil(log.time_s[0] * rate_hz), math.floor(log.time_s[-1] * rate_hz)
    time_s = np.arange(first, last + 1) / rate_hz
    samples = np.hstack([specific_force(log, time_s), np.degrees(inertial_rate(log, time_s))])
    return samples, Acquisition.of(time_s, rows.time_s[-1], rate_hz, rows.rate_out_hz)


def inertial_columns(ins: Ins, log: Trajectory, rows: Acquisition, seed: int) -> Columns:
    """Return the readings of the accelerometers and gyros of an INS, and the truth of them.

    Parameters
    ----------
    ins : Ins
    log : Trajectory
        The motion of what carries the INS.
    rows : Acquisition
        The rows of the recording. Readings and truth pass a filter as that of the magnetometers: turbulence
        faster than the rows must not fold.
    seed : int

    Returns
    -------
    dict of str to (rows,)
        Specific force [m/s^2] and inertial rate [deg/s], as read at the place of the INS and true at the reference
        point.

    Raises
    ------
    DataError
        If the clock leads out of the record.
    """
    samples, acquisition = samples_of(log, rows)
    true = acquisition(samples)
    felt = samples if ins.position_m is None else samples_of(placed(ins, log), rows)[0]
    span = (log.time_s[0] + acquisition.reach_s, log.time_s[-1] - acquisition.reach_s)
    taken = instants(ins, rows.time_s, "ins", seed, span)
    read = acquisition(felt) if taken is None else acquisition.at(felt, taken)
    rate_hz = rows.rate_out_hz
    vectors = (
        (columns.INS_ACCELERATION, accelerometers(ins)(read[:, :3], rate_hz, "ins/acc", seed)),
        (columns.INS_RATE, gyros(ins)(read[:, 3:], rate_hz, "ins/rate", seed)),
        (columns.TRUE_ACCELERATION, true[:, :3]),
        (columns.TRUE_INERTIAL_RATE, true[:, 3:]),
    )
    return {family.name(axis=a): values[:, k] for family, values in vectors for k, a in enumerate(columns.AXES)}


def read(flight: MeasuredFlight) -> Columns:
    """Return the readings of accelerometers and gyros in the body that is surveyed with, and the truth of them."""
    return inertial_columns(flight.sensors.ins, flight.log, flight.acquisition, flight.seed)
