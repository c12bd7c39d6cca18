"""The base station: a scalar magnetometer on the ground with a clock and a rate of its own."""

import math

import numpy as np

from magsim import columns
from magsim.scenario import BaseStation
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import white_noise
from magsim.sensors.scalar import norm
from magsim.streams import stream


def measure(
    time_s: np.ndarray,
    total_nt: np.ndarray,
    station: BaseStation,
    rng: np.random.Generator,
    jitter: np.random.Generator | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings of the station.

    Parameters
    ----------
    time_s : (n,) [s]
    total_nt : (n,) [nT]
        Length of the field there.
    station : BaseStation
    rng : numpy.random.Generator
        Of the noise.
    jitter : numpy.random.Generator, optional
        Of the tags, where they have jitter.

    Returns
    -------
    tag_s : (m,) [s]
        Time tags of the station's clock: ``delay_s + drift_ppm 1e-6 t`` and the jitter after the instants ``t``.
    reading_nt : (m,) [nT]
        At whole multiples of its sampling interval, from the first to the last inside of ``time_s``.
    """
    first, last = math.ceil(time_s[0] * station.rate_hz - 1e-9), math.floor(time_s[-1] * station.rate_hz + 1e-9)
    instant = np.arange(first, last + 1) / station.rate_hz
    noise = white_noise(rng, instant.shape, station.noise_nt_rthz, station.rate_hz)
    tag_s = instant + station.delay_s + 1e-6 * station.drift_ppm * instant
    if jitter is not None:
        tag_s = tag_s + station.jitter_s * jitter.standard_normal(len(tag_s))
    return tag_s, np.interp(instant, time_s, total_nt) + noise


def base_columns(
    station: BaseStation, time_s: np.ndarray, field_n: np.ndarray, acquisition: Acquisition, seed: int
) -> Columns:
    """Return reading and truth of a base station.

    Parameters
    ----------
    station : BaseStation
    time_s : (n,) [s]
        At the simulation rate, with the run-in of the filter on both sides.
    field_n : (n, 3) [nT]
        The field at the station.
    acquisition : Acquisition
    seed : int

    Returns
    -------
    dict of str to (rows,) [nT]
        ``base``: straight lines between the readings; ``true_base``: the length of the field at the rows, filtered as
        the magnetometers on board are.
    """
    total = norm(field_n)
    jitter = stream(seed, f"base/{station.name}/jitter") if station.jitter_s > 0.0 else None
    tag_s, reading = measure(time_s, total, station, stream(seed, f"base/{station.name}/noise"), jitter)
    return {
        columns.BASE.name(sensor=station.name): np.interp(acquisition.time_s, tag_s, reading),
        columns.TRUE_BASE.name(sensor=station.name): acquisition(total),
    }


def read(flight: MeasuredFlight) -> Columns:
    """Return the columns of the base station; none without one."""
    station = flight.sensors.base
    if station is None or flight.station_n is None:
        return {}
    return base_columns(station, flight.samples_s, flight.station_n, flight.acquisition, flight.seed)
