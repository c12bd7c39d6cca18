"""The three-axis fluxgate: offset, scale, angles between its axes, mounting angles, noise.

``reading_s = diag(1 + scale) N rot_sb B_b + offset + noise``

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
from magsim.sensors.noise import white_noise
from magsim.sensors.scalar import part_columns
from magsim.streams import stream
from magsim.truth import FieldTruth


def sensing_axes(angles_deg: tuple[float, float, float]) -> np.ndarray:
    """Directions of three sensing axes that are not quite at right angles.

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
    """Matrix ``diag(1 + scale) N rot_sb`` from the field in body axes to the readings without offset, (3, 3)."""
    rot_sb = rot_nb_from_attitude(np.radians(sensor.misalignment_deg)).T
    axes = sensing_axes(sensor.nonorthogonality_deg)
    return (1.0 + np.array(sensor.scale_error))[:, None] * np.einsum("ij,jk->ik", axes, rot_sb)


def measure(total_b: np.ndarray, sensor: FluxgateSensor, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
    """Reading of the instrument before the recording system.

    Parameters
    ----------
    total_b : (n, 3) [nT]
        The whole field at the fluxgate, body axes.
    sensor : FluxgateSensor
    rate_hz : float [Hz]
    rng : numpy.random.Generator

    Returns
    -------
    (n, 3) [nT]
        Sensor axes.
    """
    noise = white_noise(rng, total_b.shape, sensor.noise_nt_rthz, rate_hz)
    return rotate(response(sensor), total_b) + np.array(sensor.offset_nt) + noise


def correct(reading_s: np.ndarray, sensor: FluxgateSensor) -> np.ndarray:
    """The field that an instrument with known errors was in: the inverse of ``measure`` without noise.

    Parameters
    ----------
    reading_s : (n, 3) [nT]
    sensor : FluxgateSensor

    Returns
    -------
    (n, 3) [nT]
        Body axes.
    """
    return rotate(np.linalg.inv(response(sensor)), reading_s - np.array(sensor.offset_nt))


def fluxgate_columns(
    sensor: FluxgateSensor, truth: FieldTruth, acquisition: Acquisition, seed: int
) -> dict[str, np.ndarray]:
    """Reading and truth of one fluxgate.

    Parameters
    ----------
    sensor : FluxgateSensor
        At one of the mounts of ``truth``.
    truth : FieldTruth
    acquisition : Acquisition
    seed : int

    Returns
    -------
    dict of str to (rows,) [nT]
        ``flux`` in sensor axes, and each part of the field in body axes.
    """
    rng = stream(seed, f"fluxgate/{sensor.name}/noise")
    total_b = truth.total(sensor.mount)
    if sensor.mount in truth.tilts_b:
        total_b = turned_back(truth.tilts_b[sensor.mount], total_b)
    reading = acquisition(measure(total_b, sensor, acquisition.rate_in_hz, rng))
    out = {columns.FLUX.name(sensor=sensor.name, axis=axis): reading[:, k] for k, axis in enumerate(columns.AXES)}
    return out | part_columns(sensor.name, sensor.mount, truth, acquisition)
