"""Current and voltage sensors of the aircraft's wiring: offset, noise, and the steps of their converter."""

import numpy as np

from magsim import columns
from magsim.scenario import Electrical
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.clocks import instants
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import white_noise
from magsim.streams import stream
from magsim.truth import FieldTruth


def measure(
    true: np.ndarray, *, density: float, offset: float, step: float, rate_hz: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the readings of one channel before the recording system.

    Parameters
    ----------
    true : (n,) [unit]
        Current or voltage.
    density : float [unit/sqrt(Hz)]
        White noise.
    offset : float [unit]
        Standard deviation of the constant error, which the channel draws once.
    step : float [unit]
        Least count of the converter; 0 for none.
    rate_hz : float [Hz]
    rng : numpy.random.Generator

    Returns
    -------
    (n,) [unit]
    """
    reading = true + offset * rng.standard_normal() + white_noise(rng, true.shape, density, rate_hz)
    return reading if step == 0.0 else step * np.round(reading / step)


def electrical_columns(settings: Electrical, truth: FieldTruth, acquisition: Acquisition, seed: int) -> Columns:
    """Return the readings of all currents and voltages, and the truth of them.

    Parameters
    ----------
    settings : Electrical
    truth : FieldTruth
    acquisition : Acquisition
        The same filter as for the magnetometers.
    seed : int

    Returns
    -------
    dict of str to (rows,) [A], [V]
        Truth alone where nothing is measured; empty where the flight was computed without wiring.
    """
    rate_hz = acquisition.rate_in_hz
    span = (truth.time_s[0] + acquisition.reach_s, truth.time_s[-1] - acquisition.reach_s)

    def rows(name: str, reading: np.ndarray) -> np.ndarray:
        taken = instants(settings, acquisition.time_s, name, seed, span)
        return acquisition(reading) if taken is None else acquisition.at(reading, taken)

    out = {columns.TRUE_CURRENT.name(feeder=name): acquisition(current) for name, current in truth.currents_a.items()}
    out |= {columns.TRUE_VOLTAGE.name(bus=name): acquisition(voltage) for name, voltage in truth.voltages_v.items()}
    if not settings.enabled:
        return out
    for name, current in truth.currents_a.items():
        if name in settings.without:
            continue
        reading = measure(
            current,
            density=settings.current_noise_a_rthz,
            offset=settings.current_offset_a,
            step=settings.current_step_a,
            rate_hz=rate_hz,
            rng=stream(seed, f"electrical/current/{name}"),
        )
        out[columns.CURRENT.name(feeder=name)] = rows(f"electrical/current/{name}", reading)
    for name, voltage in truth.voltages_v.items():
        reading = measure(
            voltage,
            density=settings.voltage_noise_v_rthz,
            offset=settings.voltage_offset_v,
            step=settings.voltage_step_v,
            rate_hz=rate_hz,
            rng=stream(seed, f"electrical/voltage/{name}"),
        )
        out[columns.VOLTAGE.name(bus=name)] = rows(f"electrical/voltage/{name}", reading)
    return out


def read(flight: MeasuredFlight) -> Columns:
    """Return the readings of all current and voltage sensors and the truth of them, carrier first."""
    out: Columns = {}
    for truth in flight.truths.values():
        out |= electrical_columns(flight.sensors.electrical, truth, flight.acquisition, flight.seed)
    return out
