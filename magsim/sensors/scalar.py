"""The scalar (total-field) magnetometer: it reads the length of the exact vector sum."""

import numpy as np

from magsim import columns
from magsim.scenario import ScalarSensor
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.noise import white_noise
from magsim.streams import stream
from magsim.truth import FieldTruth


def norm(vectors: np.ndarray) -> np.ndarray:
    """Length of ``(n, 3)`` vectors, (n,)."""
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


def measure(total_nt: np.ndarray, sensor: ScalarSensor, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
    """Reading of the instrument before the recording system.

    Parameters
    ----------
    total_nt : (n,) [nT]
        Length of the whole field.
    sensor : ScalarSensor
    rate_hz : float [Hz]
    rng : numpy.random.Generator

    Returns
    -------
    (n,) [nT]
        The length with white noise.
    """
    return total_nt + white_noise(rng, total_nt.shape, sensor.noise_nt_rthz, rate_hz)


def scalar_columns(
    sensor: ScalarSensor, truth: FieldTruth, acquisition: Acquisition, seed: int
) -> dict[str, np.ndarray]:
    """Reading, labels and truth of one scalar magnetometer.

    Parameters
    ----------
    sensor : ScalarSensor
        At one of the mounts of ``truth``.
    truth : FieldTruth
    acquisition : Acquisition
        Filters everything here alike.
    seed : int

    Returns
    -------
    dict of str to (rows,) [nT]
        ``mag``, ``interference`` (filtered norm of the whole field less filtered norm of the background),
        ``projection`` (filtered component of the aircraft's field along the background), ``clean``, ``total``,
        ``error``, and each part in body axes.
    """
    background, platform = truth.background(sensor.mount), truth.platform(sensor.mount)
    clean, total = norm(background), norm(background + platform)
    rng = stream(seed, f"scalar/{sensor.name}/noise")
    samples = np.stack(
        [
            measure(total, sensor, acquisition.rate_in_hz, rng),
            clean,
            total,
            np.einsum("ni,ni->n", platform, background) / clean,
        ],
        axis=1,
    )
    reading, clean, total, projection = acquisition(samples).T
    values = {
        columns.MAG: reading,
        columns.INTERFERENCE: total - clean,
        columns.PROJECTION: projection,
        columns.CLEAN: clean,
        columns.TOTAL: total,
        columns.ERROR: reading - total,
    }
    out = {family.name(sensor=sensor.name): column for family, column in values.items()}
    return out | part_columns(sensor.name, sensor.mount, truth, acquisition)


def part_columns(name: str, mount: str, truth: FieldTruth, acquisition: Acquisition) -> dict[str, np.ndarray]:
    """Every part of the field at a sensor, filtered by axis, body axes, (rows,) [nT] each.

    Parameters
    ----------
    name, mount : str
        Of the sensor.
    truth : FieldTruth
    acquisition : Acquisition
    """
    out = {}
    for component in truth.parts_b:
        rows = acquisition(truth.part(component, mount))
        for k, axis in enumerate(columns.AXES):
            out[columns.PART.name(component=component, sensor=name, axis=axis)] = rows[:, k]
    return out
