"""The scalar (total-field) magnetometer: it reads the length of the exact vector sum, with errors of its own.

``reading = hold(step(window(lag(|B| + heading + gyro) + noise) + tones))``, docs/instruments.md. Where it cannot
read, the row holds the last reading and ``mag_{sensor}_valid`` is 0.
"""

import math

import numpy as np

from magsim import columns
from magsim.frames import turned_back
from magsim.scenario import ScalarSensor, Tone
from magsim.sensors.acquisition import Acquisition, Counter
from magsim.sensors.clocks import instants
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import flicker_noise, white_noise
from magsim.signals import first_order_lag
from magsim.streams import stream
from magsim.truth import FieldTruth

LARMOR_HZ_NT = 3.498572
"""Larmor frequency of cesium 133 [Hz/nT] (Geometrics, G-862 manual 27921-OM, section 3)."""


def norm(vectors: np.ndarray) -> np.ndarray:
    """Return the length of ``(n, 3)`` vectors, (n,)."""
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))


def axis_cosine(total_b: np.ndarray, sensor: ScalarSensor) -> np.ndarray:
    """Return the cosine of the angle between the optical axis and the field, (n, 3) to (n,)."""
    axis = np.array(sensor.axis_b) / math.hypot(*sensor.axis_b)
    return np.clip(np.einsum("ni,i->n", total_b, axis) / norm(total_b), -1.0, 1.0)


def heading_error(cosine: np.ndarray, sensor: ScalarSensor) -> np.ndarray:
    """Return ``a cos t + b cos 2t + c sign(cos t)``, (n,) [nT]; the last is the switch of hemispheres."""
    return (
        sensor.heading_cos_nt * cosine
        + sensor.heading_cos2_nt * (2.0 * cosine**2 - 1.0)
        + sensor.heading_switch_nt * np.where(cosine >= 0.0, 1.0, -1.0)
    )


def gyro_error(total_b: np.ndarray, rate_b: np.ndarray) -> np.ndarray:
    """Return what turning about the field adds to the Larmor frequency: ``w . u / (2 pi gamma)``, (n,) [nT].

    Parameters
    ----------
    total_b : (n, 3) [nT]
    rate_b : (n, 3) [rad/s]
    """
    return np.einsum("ni,ni->n", rate_b, total_b) / norm(total_b) / (2.0 * np.pi * LARMOR_HZ_NT)


def measure(
    total_b: np.ndarray,
    sensor: ScalarSensor,
    rate_hz: float,
    rng: np.random.Generator,
    *,
    total_nt: np.ndarray | None = None,
    rate_b: np.ndarray | None = None,
) -> np.ndarray:
    """Return the reading of the instrument before its counter or the recording system.

    Parameters
    ----------
    total_b : (n, 3) [nT]
        The whole field, axes of what carries the instrument.
    sensor : ScalarSensor
    rate_hz : float [Hz]
    rng : numpy.random.Generator
    total_nt : (n,) [nT], optional
        Length of the field, where it is known already.
    rate_b : (n, 3) [rad/s], optional
        Angular rate; without it, nothing turns.

    Returns
    -------
    (n,) [nT]
    """
    reading = norm(total_b) if total_nt is None else total_nt
    if sensor.heading_cos_nt or sensor.heading_cos2_nt or sensor.heading_switch_nt:
        reading = reading + heading_error(axis_cosine(total_b, sensor), sensor)
    if sensor.gyro_shift and rate_b is not None:
        reading = reading + sensor.gyro_shift * gyro_error(total_b, rate_b)
    reading = first_order_lag(reading, sensor.lag_s, rate_hz)
    return reading + white_noise(rng, reading.shape, sensor.noise_nt_rthz, rate_hz)


def tone_mean(
    tone: Tone, taken_s: np.ndarray, sensor: ScalarSensor, phase: float, along: np.ndarray | float = 1.0
) -> np.ndarray:
    """Return what a tone adds to the means over a counter's windows: exact, however far above the rows it is.

    Parameters
    ----------
    tone : Tone
    taken_s : (m,) [s]
        Middles of the windows.
    sensor : ScalarSensor
        Its window, and the lag that comes before it.
    phase : float [rad]
        Of the tone at time 0.
    along : (m,), optional
        Cosine between the tone's field and the main one.

    Returns
    -------
    (m,) [nT]
        ``a sinc(f T) cos(2 pi f t + phase)``, with gain and delay of the lag. What a tone of 1000 nT across the main
        field adds by its square, 0.005 nT of 50 000, is neglected.
    """
    turns = tone.frequency_hz * taken_s
    lagged = 1.0 / (1.0 + 2.0j * math.pi * tone.frequency_hz * sensor.lag_s)
    angle = 2.0 * math.pi * (turns - np.floor(turns)) + phase + np.angle(lagged)
    gain = tone.amplitude_nt * np.sinc(tone.frequency_hz * sensor.counter_s) * abs(lagged)
    return gain * along * np.cos(angle)


def tones_read(
    sensor: ScalarSensor, window: Acquisition | Counter, field_b: np.ndarray, taken_s: np.ndarray, seed: int
) -> np.ndarray:
    """Return the sum of all tones in the rows of an instrument, (rows,) [nT].

    One tone has one phase at all instruments: they hear the same source.
    """
    out = np.zeros(len(taken_s))
    for tone in sensor.tones:
        phase = 2.0 * math.pi * float(stream(seed, f"scalar/tone/{tone.frequency_hz:g}").uniform())
        along: np.ndarray | float = 1.0
        if tone.axis_b is not None:
            direction = np.array(tone.axis_b) / math.hypot(*tone.axis_b)
            along = window.at(np.einsum("ni,i->n", field_b, direction) / norm(field_b), taken_s)
        out += tone_mean(tone, taken_s, sensor, phase, along)
    return out


def locked(total_b: np.ndarray, sensor: ScalarSensor, rate_hz: float) -> np.ndarray:
    """Return where the instrument reads, (n,): outside dead zones, inside its range, and ``relock_s`` after."""
    lost = np.zeros(len(total_b), dtype=bool)
    steep = np.abs(axis_cosine(total_b, sensor))
    if sensor.dead_polar_deg > 0.0:
        lost |= steep > math.cos(math.radians(sensor.dead_polar_deg))
    if sensor.dead_equator_deg > 0.0:
        lost |= steep < math.sin(math.radians(sensor.dead_equator_deg))
    if sensor.range_nt is not None:
        total = norm(total_b)
        lost |= (total < sensor.range_nt[0]) | (total > sensor.range_nt[1])
    samples = np.arange(len(total_b))
    last = np.maximum.accumulate(np.where(lost, samples, -len(samples) - math.ceil(sensor.relock_s * rate_hz)))
    return samples - last > sensor.relock_s * rate_hz if sensor.relock_s > 0.0 else ~lost


def hold(reading: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Return the readings with the last valid one in place of invalid ones, (n,); 0 before the first."""
    last = np.maximum.accumulate(np.where(valid, np.arange(len(valid)), -1))
    return np.where(last >= 0, reading[last], 0.0)


def scalar_columns(
    sensor: ScalarSensor,
    truth: FieldTruth,
    acquisition: Acquisition,
    seed: int,
    rate_b: np.ndarray | None = None,
) -> Columns:
    """Return reading, labels and truth of one scalar magnetometer.

    Parameters
    ----------
    sensor : ScalarSensor
        At one of the mounts of ``truth``.
    truth : FieldTruth
    acquisition : Acquisition
        Filters everything here alike, unless the instrument counts: then its window does.
    seed : int
    rate_b : (n, 3) [rad/s], optional
        Angular rate at the samples, for the gyro shift.

    Returns
    -------
    dict of str to (rows,) [nT]
        ``mag``, ``interference`` (filtered norm of the whole field less filtered norm of the background),
        ``projection`` (filtered component of the aircraft's field along the background), ``clean``, ``total``,
        ``error``, and each part in body axes; ``mag_valid`` [1] where the instrument can drop out; ``swing`` in a
        towed bird.

    Raises
    ------
    DataError
        If the clock leads out of the record.
    """
    window = Counter(acquisition, sensor.counter_s) if sensor.counter_s > 0.0 else acquisition
    background, platform = truth.background(sensor.mount), truth.platform(sensor.mount)
    total_b = background + platform
    clean, total = norm(background), norm(total_b)
    sensor_b = turned_back(truth.tilts_b[sensor.mount], total_b) if sensor.mount in truth.tilts_b else total_b
    rng = stream(seed, f"scalar/{sensor.name}/noise")
    raw = measure(sensor_b, sensor, acquisition.rate_in_hz, rng, total_nt=total, rate_b=rate_b)
    if sensor.flicker_nt_rthz > 0.0:
        slow = stream(seed, f"scalar/{sensor.name}/flicker")
        raw = raw + flicker_noise(slow, truth.time_s, 1, sensor.flicker_nt_rthz)[:, 0]
    along = np.einsum("ni,ni->n", platform, background) / clean
    taken = _taken(sensor, truth, window, seed)
    if taken is None:
        reading, clean, total, projection = window(np.stack([raw, clean, total, along], axis=1)).T
    else:
        clean, total, projection = window(np.stack([clean, total, along], axis=1)).T
        reading = window.at(raw, taken)
    if sensor.tones:
        reading = reading + tones_read(sensor, window, sensor_b, window.time_s if taken is None else taken, seed)
    if sensor.step_nt > 0.0:
        reading = sensor.step_nt * np.round(reading / sensor.step_nt)
    out = {}
    if sensor.can_drop_out:
        place = acquisition.place_of(acquisition.time_s if taken is None else taken)
        width = (sensor.counter_s or 1.0 / acquisition.rate_out_hz) * acquisition.rate_in_hz
        valid = whole_windows(locked(sensor_b, sensor, acquisition.rate_in_hz), place, width)
        reading = hold(reading, valid)
        out[columns.MAG_VALID.name(sensor=sensor.name)] = valid.astype(float)
    values = {
        columns.MAG: reading,
        columns.INTERFERENCE: total - clean,
        columns.PROJECTION: projection,
        columns.CLEAN: clean,
        columns.TOTAL: total,
        columns.ERROR: reading - total,
    }
    if sensor.mount in truth.steady_nt:
        values[columns.SWING] = clean - window(truth.steady_nt[sensor.mount])
    out |= {family.name(sensor=sensor.name): column for family, column in values.items()}
    return out | part_columns(sensor.name, sensor.mount, truth, window)


def whole_windows(good: np.ndarray, place: np.ndarray, width: float) -> np.ndarray:
    """Return where all samples of a window around a position are good: (n,) and (m,) [samples] to (m,)."""
    count = np.concatenate([[0], np.cumsum(~good)])
    start = np.ceil(place - width / 2.0 - 1e-6).astype(int)
    stop = np.floor(place + width / 2.0 + 1e-6).astype(int) + 1
    return count[stop] == count[start]


def _taken(sensor: ScalarSensor, truth: FieldTruth, window: Acquisition | Counter, seed: int) -> np.ndarray | None:
    """Return the middles of the windows of the rows, (rows,) [s]; None where they are the tags."""
    span = (truth.time_s[0] + window.reach_s + sensor.counter_s, truth.time_s[-1] - window.reach_s)
    taken = instants(sensor, window.time_s, f"scalar/{sensor.name}", seed, span)
    if sensor.counter_s > 0.0 and sensor.counter_tag == "end":
        taken = (window.time_s if taken is None else taken) - sensor.counter_s / 2.0
    return taken


def part_columns(name: str, mount: str, truth: FieldTruth, acquisition: Acquisition | Counter) -> Columns:
    """Return every part of the field at a sensor by axis, and the change where its mount bends, (rows,) [nT] each.

    Parameters
    ----------
    name, mount : str
        Of the sensor.
    truth : FieldTruth
    acquisition : Acquisition or Counter
    """
    out = {}
    for component in truth.parts_b:
        rows = acquisition(truth.part(component, mount))
        for k, axis in enumerate(columns.AXES):
            out[columns.PART.name(component=component, sensor=name, axis=axis)] = rows[:, k]
    if mount in truth.bent_b:
        rows = acquisition(truth.bent_b[mount])
        out |= {columns.FLEX.name(sensor=name, axis=axis): rows[:, k] for k, axis in enumerate(columns.AXES)}
    return out


def read(flight: MeasuredFlight) -> Columns:
    """Return the columns of all scalar magnetometers."""
    out: Columns = {}
    for sensor in flight.sensors.scalar:
        rate_b = flight.rate_b(sensor.body) if sensor.gyro_shift else None
        out |= scalar_columns(sensor, flight.truths[sensor.body], flight.acquisition, flight.seed, rate_b)
    return out
