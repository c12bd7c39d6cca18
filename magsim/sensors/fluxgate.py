"""The three-axis fluxgate: offset, scale, angles of axes, mounting and flexure, temperature, noise, limits.

``field_s = diag(1 + scale) N rot_sb B_b``, ``reading_s = clip(lag(diag(1 + k dT) field_s + offset + o dT + cross)
+ noise)``, whose rows are whole steps

- ``rot_sb`` turns body axes into the axes of the mounted instrument. The misalignment is the attitude of the
  instrument in the body: roll, pitch, yaw, turned in the order yaw, pitch, roll, ``rot_sb = rot_nb(angles)^T``.
- The rows of ``N`` are the true directions of the three sensing axes: x as mounted, y in the plane of x and y, and
  z where its angles to both put it. The angles are what each pair has beyond 90 degrees.
"""

import math

import numpy as np

from magsim import columns
from magsim.frames import rot_nb_from_attitude, rotate, turned_back
from magsim.scenario import FluxgateSensor
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.clocks import instants
from magsim.sensors.inertial import load_factor
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import flicker_noise, white_noise
from magsim.sensors.scalar import part_columns
from magsim.signals import first_order_lag
from magsim.streams import stream
from magsim.truth import FieldTruth


def sensing_axes(angles_deg: tuple[float, float, float]) -> np.ndarray:
    """Return the directions of three sensing axes that are not quite at right angles.

    Parameters
    ----------
    angles_deg : (xy, xz, yz) [deg]
        What the angle between each pair has beyond 90 degrees.

    Returns
    -------
    (3, 3)
        ``N``: unit vectors as rows, lower triangular.

    Raises
    ------
    ValueError
        If no three axes have such angles.
    """
    xy, xz, yz = (math.sin(math.radians(angle)) for angle in angles_deg)
    if abs(xy) < 1.0:
        y_across = math.sqrt(1.0 - xy**2)
        z_across = -(yz + xy * xz) / y_across
        height2 = 1.0 - xz**2 - z_across**2
        if height2 > 0.0:
            return np.array([[1.0, 0.0, 0.0], [-xy, y_across, 0.0], [-xz, z_across, math.sqrt(height2)]])
    msg = f"no three axes can be {tuple(angles_deg)} degrees beyond right angles to each other"
    raise ValueError(msg)


def response(sensor: FluxgateSensor) -> np.ndarray:
    """Return the matrix ``diag(1 + scale) N rot_sb`` from field, body axes, to readings without offset, (3, 3)."""
    rot_sb = rot_nb_from_attitude(np.radians(sensor.misalignment_deg)).T
    axes = sensing_axes(sensor.nonorthogonality_deg)
    return (1.0 + np.array(sensor.scale_error))[:, None] * np.einsum("ij,jk->ik", axes, rot_sb)


def cross_field(field_s: np.ndarray, sensor: FluxgateSensor) -> np.ndarray:
    """Return the error of each axis by the field across it, ``c (B_across / 50 000 nT)^2``, (n, 3) [nT].

    Makers state its size, not its form: this is the form of an effect that does not depend on the sign of the field
    across (ring cores: about 10 nT, Ripka and Billingsley).
    """
    squares = (field_s / 50_000.0) ** 2
    return np.array(sensor.cross_field_nt) * (squares.sum(axis=1, keepdims=True) - squares)


def measure(
    total_b: np.ndarray,
    sensor: FluxgateSensor,
    rate_hz: float,
    rng: np.random.Generator,
    cabin_c: np.ndarray | None = None,
    *,
    flicker: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Return the reading of the instrument before the recording system.

    Parameters
    ----------
    total_b : (n, 3) [nT]
        The whole field at the fluxgate, body axes.
    sensor : FluxgateSensor
    rate_hz : float [Hz]
    rng : numpy.random.Generator
    cabin_c : (n,) [degC], optional
        Temperature of the cabin; without it, that of the instrument's reference.
    flicker : (n, 3) [nT], optional
        Its 1/f noise.

    Returns
    -------
    (n, 3) [nT]
        Sensor axes.
    """
    field_s = rotate(response(sensor), total_b)
    reading = field_s
    if cabin_c is not None:
        beyond = (cabin_c - sensor.reference_c)[:, None]
        reading = reading * (1.0 + 1e-6 * np.array(sensor.scale_drift_ppm_c) * beyond)
        reading = reading + np.array(sensor.offset_drift_nt_c) * beyond
    if any(sensor.cross_field_nt):
        reading = reading + cross_field(field_s, sensor)
    noise = white_noise(rng, total_b.shape, sensor.noise_nt_rthz, rate_hz)
    if sensor.bandwidth_hz is not None:
        reading = first_order_lag(reading, 1.0 / (2.0 * math.pi * sensor.bandwidth_hz), rate_hz)
    reading = reading + np.array(sensor.offset_nt) + noise + flicker
    return reading if sensor.range_nt is None else np.clip(reading, -sensor.range_nt, sensor.range_nt)


def fluxgate_columns(
    sensor: FluxgateSensor,
    truth: FieldTruth,
    acquisition: Acquisition,
    seed: int,
    cabin_c: np.ndarray | None = None,
    *,
    load_g: np.ndarray | None = None,
) -> Columns:
    """Return reading and truth of one fluxgate.

    Parameters
    ----------
    sensor : FluxgateSensor
        At one of the mounts of ``truth``.
    truth : FieldTruth
    acquisition : Acquisition
    seed : int
    cabin_c : (n,) [degC], optional
        Temperature of the cabin.
    load_g : (n,) [g], optional
        Load factor of what carries it, for the flexure.

    Returns
    -------
    dict of str to (rows,) [nT]
        ``flux`` in sensor axes; ``fluxerror``, by which each reading differs from the whole field along the body axis
        of its name; and each part of the field in body axes.

    Raises
    ------
    DataError
        If the clock leads out of the record.
    """
    rng = stream(seed, f"fluxgate/{sensor.name}/noise")
    total_b = truth.total(sensor.mount)
    ideal = acquisition(total_b)
    if sensor.mount in truth.tilts_b:
        total_b = turned_back(truth.tilts_b[sensor.mount], total_b)
    if load_g is not None:
        total_b = turned_back(np.radians(sensor.flexure_deg_g) * (load_g - 1.0)[:, None], total_b)
    flicker: np.ndarray | float = 0.0
    if sensor.flicker_nt_rthz > 0.0:
        slow = stream(seed, f"fluxgate/{sensor.name}/flicker")
        flicker = flicker_noise(slow, truth.time_s, 3, sensor.flicker_nt_rthz)
    raw = measure(total_b, sensor, acquisition.rate_in_hz, rng, cabin_c, flicker=flicker)
    span = (truth.time_s[0] + acquisition.reach_s, truth.time_s[-1] - acquisition.reach_s)
    taken = instants(sensor, acquisition.time_s, f"fluxgate/{sensor.name}", seed, span)
    reading = acquisition(raw) if taken is None else acquisition.at(raw, taken)
    if sensor.step_nt > 0.0:
        reading = sensor.step_nt * np.round(reading / sensor.step_nt)
    vectors = ((columns.FLUX, reading), (columns.FLUX_ERROR, reading - ideal))
    out = {
        family.name(sensor=sensor.name, axis=a): v[:, k] for family, v in vectors for k, a in enumerate(columns.AXES)
    }
    return out | part_columns(sensor.name, sensor.mount, truth, acquisition)


def read(flight: MeasuredFlight) -> Columns:
    """Return the columns of all fluxgates."""
    out: Columns = {}
    for sensor in flight.sensors.fluxgate:
        load_g = load_factor(flight.log_of(sensor.body), flight.samples_s) if any(sensor.flexure_deg_g) else None
        truth = flight.truths[sensor.body]
        out |= fluxgate_columns(sensor, truth, flight.acquisition, flight.seed, flight.cabin_c, load_g=load_g)
    return out
