"""Sway: departures of a human pilot from the path."""

import math

import numpy as np
from scipy import signal
from scipy.interpolate import make_interp_spline

from magsim.streams import stream

SWAY_HZ = 10.0
"""Sway is drawn on a grid of its own."""


def sway(time_s: np.ndarray, spreads_m: tuple[float, float], band_hz: tuple[float, float], seed: int) -> np.ndarray:
    """Draw departures from the path, right and down, (n, 2) [m]: white noise, band-passed forward and backward.

    Parameters
    ----------
    time_s : (n,) [s]
    spreads_m : (float, float)
        Standard deviations.
    band_hz : (low, high)
        Of a Butterworth band-pass of second order.
    seed : int
    """
    sos = signal.butter(2, band_hz, "bandpass", fs=SWAY_HZ, output="sos")
    # the run-in of the filter: some periods of the lower edge
    lead = math.ceil(5.0 / band_hz[0] * SWAY_HZ)
    first, last = math.floor(time_s[0] * SWAY_HZ) - lead, math.ceil(time_s[-1] * SWAY_HZ) + lead
    knots = np.arange(first, last + 1) / SWAY_HZ
    _, gain = signal.sosfreqz(sos, worN=1 << 15, fs=SWAY_HZ)
    power = float(np.mean(np.abs(gain) ** 4))
    out = np.empty((len(time_s), 2))
    for k, name in enumerate(("lateral", "vertical")):
        # times before 0 have their own random numbers, so that a longer run-in gives the same flight
        before, after = (stream(seed, f"carrier/sway/{name}/{side}") for side in ("before", "after"))
        noise = np.concatenate([before.standard_normal(max(0, -first))[::-1], after.standard_normal(max(0, last + 1))])
        moved = signal.sosfiltfilt(sos, noise, padtype=None) * (spreads_m[k] / math.sqrt(power))
        # of fifth degree: the bank follows its second derivative, and the hook the second derivative of that
        out[:, k] = make_interp_spline(knots, moved, k=5)(time_s)
    return out
