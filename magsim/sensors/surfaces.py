"""Potentiometers of the control surfaces: ``reading = step(lag((1 + scale) backlash(true)) + offset + noise)``.

A linkage with play joins the surface to its potentiometer: where the surface turns back, the potentiometer rests until
the play is used up.
"""

import numpy as np

from magsim import columns
from magsim.scenario import Surfaces
from magsim.sensors.acquisition import Acquisition
from magsim.sensors.clocks import instants
from magsim.sensors.instrument import Columns, MeasuredFlight
from magsim.sensors.noise import white_noise
from magsim.signals import first_order_lag
from magsim.storage.compiled import compiled
from magsim.streams import stream


def backlash(values: np.ndarray, play: float) -> np.ndarray:
    """Return what follows a motion through play: the play operator of hysteresis, begun in its middle.

    Parameters
    ----------
    values : (n,) [unit]
    play : float [unit]
        How far the motion turns back before anything follows.

    Returns
    -------
    (n,) [unit]
        ``y_k = min(max(y_{k-1}, x_k - play / 2), x_k + play / 2)`` (Visintin, Differential Models of
        Hysteresis, section III.2).
    """
    values = np.asarray(values, dtype=float)
    if play == 0.0:
        return values
    return _followed(values, 0.5 * play)


@compiled
def _followed(values: np.ndarray, half: float) -> np.ndarray:
    out, last = np.empty_like(values), values[0]
    for k in range(len(values)):
        last = min(max(last, values[k] - half), values[k] + half)
        out[k] = last
    return out


def measure(
    true_deg: np.ndarray, settings: Surfaces, rate_hz: float, constant: np.random.Generator, noise: np.random.Generator
) -> np.ndarray:
    """Return the readings of one potentiometer before the recording system.

    Parameters
    ----------
    true_deg : (n,) [deg]
        Deflection.
    settings : Surfaces
    rate_hz : float [Hz]
    constant, noise : numpy.random.Generator
        Of scale error and offset, which the channel draws once, and of its noise.

    Returns
    -------
    (n,) [deg]
    """
    scale, offset = np.array([settings.scale_error, settings.offset_deg]) * constant.standard_normal(2)
    turned = (1.0 + scale) * backlash(true_deg, settings.backlash_deg)
    reading = first_order_lag(turned, settings.lag_s, rate_hz) + offset
    reading = reading + white_noise(noise, true_deg.shape, settings.noise_deg_rthz, rate_hz)
    return reading if settings.step_deg == 0.0 else settings.step_deg * np.round(reading / settings.step_deg)


def surface_columns(
    settings: Surfaces, true_deg: dict[str, np.ndarray], time_s: np.ndarray, acquisition: Acquisition, seed: int
) -> Columns:
    """Return the readings of the potentiometers, and the truth of all surfaces.

    Parameters
    ----------
    settings : Surfaces
    true_deg : dict of str to (n,) [deg]
        Deflection of each surface that the flight logs.
    time_s : (n,) [s]
        At the simulation rate, with the run-in of the filter on both sides.
    acquisition : Acquisition
        The same filter as for the magnetometers.
    seed : int

    Returns
    -------
    dict of str to (rows,) [deg]

    Raises
    ------
    DataError
        If the clock leads out of the record.
    """
    out = {columns.TRUE_SURFACE.name(surface=name): acquisition(angle) for name, angle in true_deg.items()}
    if not settings.enabled:
        return out
    span = (time_s[0] + acquisition.reach_s, time_s[-1] - acquisition.reach_s)
    for name, angle in true_deg.items():
        if name in settings.without:
            continue
        channel = f"surface/{name}"
        constant, noise = stream(seed, f"{channel}/constant"), stream(seed, f"{channel}/noise")
        reading = measure(angle, settings, acquisition.rate_in_hz, constant, noise)
        taken = instants(settings, acquisition.time_s, channel, seed, span)
        rows = acquisition(reading) if taken is None else acquisition.at(reading, taken)
        out[columns.SURFACE.name(surface=name)] = rows
    return out


def read(flight: MeasuredFlight) -> Columns:
    """Return the readings of the potentiometers of the carrier's control surfaces, and the truth of them."""
    angles = flight.flight.controls_at(flight.samples_s)
    true_deg = {name: np.degrees(angle) for name, angle in angles.items()}
    return surface_columns(flight.sensors.surfaces, true_deg, flight.samples_s, flight.acquisition, flight.seed)
