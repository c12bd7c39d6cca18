"""Sway: how air and hands move a carrier about its path and turn its nose.

In accelerations the sway is even noise between two frequencies, and so is the bank that follows from it: below the
lower one the pilot returns to the line, above the upper one he holds the attitude. That is the form of the roll
spectrum of a helicopter whose lateral dynamics are published, in gusts and under a pilot (``docs/tow.md``).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy import signal
from scipy.interpolate import make_interp_spline

from magsim.streams import stream

SWAY_HZ = 10.0
"""Sway is drawn on a grid of its own."""


class SwaySize(NamedTuple):
    """Standard deviations: of the place along the path, to the right and downward [m], and of the heading [rad].

    The heading counts from that of a flight without sideslip.
    """

    along_m: float
    lateral_m: float
    vertical_m: float
    heading_rad: float


def sway(time_s: np.ndarray, size: SwaySize, band_hz: tuple[float, float], seed: int) -> np.ndarray:
    """Draw departures from the path along, right and down [m] and in heading [rad], (n, 4).

    White noise through low passes. At the lower edge of the band the power of a place falls with the fourth power of
    the frequency, so that accelerations are even within the band, and that of the heading with the second, as in a
    coordinated turn; at the upper edge both fall with the eighth power more.

    Parameters
    ----------
    time_s : (n,) [s]
    size : SwaySize
    band_hz : (low, high)
    seed : int
    """
    line, attitude = (signal.butter(n, edge, fs=SWAY_HZ, output="sos") for n, edge in zip((1, 2), band_hz, strict=True))
    # the run-in of the filters: some periods of the lower edge
    lead = math.ceil(5.0 / band_hz[0] * SWAY_HZ)
    first, last = math.floor(time_s[0] * SWAY_HZ) - lead, math.ceil(time_s[-1] * SWAY_HZ) + lead
    knots = np.arange(first, last + 1) / SWAY_HZ
    slow, fast = (np.abs(signal.sosfreqz(sos, worN=1 << 15, fs=SWAY_HZ)[1]) for sos in (line, attitude))
    out = np.empty((len(time_s), 4))
    for k, name in enumerate(("along", "lateral", "vertical", "heading")):
        # times before 0 have their own random numbers, so that a longer run-in gives the same flight
        before, after = (stream(seed, f"carrier/sway/{name}/{side}") for side in ("before", "after"))
        noise = np.concatenate([before.standard_normal(max(0, -first))[::-1], after.standard_normal(max(0, last + 1))])
        steady = signal.sosfiltfilt(attitude, noise, padtype=None)
        turns = name == "heading"
        moved = signal.sosfilt(line, steady) if turns else signal.sosfiltfilt(line, steady, padtype=None)
        power = float(np.mean((slow if turns else slow**2) ** 2 * fast**4))
        # of fifth degree: the bank follows its second derivative, and the hook the second derivative of that
        out[:, k] = make_interp_spline(knots, moved * (size[k] / math.sqrt(power)), k=5)(time_s)
    return out
