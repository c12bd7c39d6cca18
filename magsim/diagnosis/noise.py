"""Noise of a scalar magnetometer in band: known, or seen above the band."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from magsim import columns, signals
from magsim.errors import RequestError
from magsim.recording import Recording

QUIET_HZ = (1.0, 3.0)
"""Where a reading shows its noise: above the maneuvers, below the rotors and what the anti-alias filter takes."""

WINDOW_S = 10.0
"""Of the spectrum there."""


class BandNoise(NamedTuple):
    """Noise of a reading in band."""

    std_nt: float
    source: str
    """Where it is from, in words."""


def white_in_band(rate_hz: float, lags: int) -> np.ndarray:
    """Return the autocorrelation of band-passed white noise, (lags + 1,), 1 at lag 0."""
    response = _impulse(rate_hz)
    whole = np.correlate(response, response, "full")[len(response) - 1 :]
    return np.pad(whole, (0, max(lags + 1 - len(whole), 0)))[: lags + 1] / whole[0]


def _impulse(rate_hz: float) -> np.ndarray:
    """Return the response of the band-pass to an impulse."""
    half = round(2.0 * signals.EDGE_S * rate_hz)
    impulse = np.zeros(2 * half + 1)
    impulse[half] = 1.0
    return signals.band_pass(impulse, rate_hz)


def band_noise(recordings: Sequence[Recording], sensor: str, given_nt: float | None = None) -> BandNoise:
    """Return the noise of a magnetometer in band: as given, by the truth, else from the reading above the band.

    Parameters
    ----------
    recordings : sequence of Recording
    sensor : str
    given_nt : float, optional [nT]

    Raises
    ------
    RequestError
        If the reading is too short, or its rate too low, to show it.
    """
    if given_nt is not None:
        return BandNoise(given_nt, "as given")
    name = columns.ERROR.name(sensor=sensor)
    if all(name in recording for recording in recordings):
        parts = [signals.in_band(recording[name], recording.time_s) for recording in recordings]
        found = np.concatenate(parts)
        if len(found):
            return BandNoise(float(np.sqrt(np.mean(found**2))), "truth: the instrument's error in 0.1 to 0.6 Hz")
    power = _quiet_power([recording for recording in recordings if recording.rate_hz > 2.0 * QUIET_HZ[1]], sensor)
    if power is None:
        msg = (
            f"the noise of {sensor!r} cannot be seen in its reading: that needs a piece of {WINDOW_S:g} s at more than "
            f"{2.0 * QUIET_HZ[1]:g} rows a second; give it in nT (--noise)"
        )
        raise RequestError(msg)
    rate_hz = recordings[0].rate_hz
    gain = float(np.sum(_impulse(rate_hz) ** 2))
    low, high = QUIET_HZ
    source = f"the reading between {low:g} and {high:g} Hz, taken as white"
    return BandNoise(float(np.sqrt(power * rate_hz / 2.0 * gain)), source)


def _quiet_power(recordings: Sequence[Recording], sensor: str) -> float | None:
    """Return the median power density from 1 to 3 Hz [nT^2/Hz]; None where no piece is long enough."""
    found = []
    for recording in recordings:
        for span in signals.spans(recording.time_s):
            size = round(WINDOW_S * recording.rate_hz)
            rows = recording.reads(sensor)[span]
            values = recording[columns.MAG.name(sensor=sensor)][span]
            if len(values) >= size and rows.all():
                frequency, power = welch(values, recording.rate_hz, nperseg=size, detrend="linear")
                found.append(power[(frequency >= QUIET_HZ[0]) & (frequency <= QUIET_HZ[1])])
    return float(np.median(np.concatenate(found))) if found else None
