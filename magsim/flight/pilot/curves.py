"""The curve of a sine train over time, compiled; ``cycles`` describes it."""

import math

import numpy as np

from magsim.storage.compiled import Record, compiled

QUARTER = 0.5 * math.pi
NEWTON_RAD = 1e-10
"""Newton's steps to the phase at a time end below this."""


CURVE = np.dtype(
    [
        ("axis", "i8"),
        ("start_s", "f8"),
        ("stop_s", "f8"),
        ("ease_in_s", "f8"),
        ("ease_out_s", "f8"),
        ("over_s", "f8"),
        ("period_s", "f8"),
        ("direct", "f8"),
        ("quadrature", "f8"),
        ("first", "i8"),
        ("last", "i8"),
    ]
)
"""A curve in time: its axis (a number of ``AXES``), beginning of the first cycle, length of the cycles, easings, when
it is over, mean period, factors of the curve and of its derivative, and the rows of its cycles."""


@compiled
def value_at(curve: Record, cycles: np.ndarray, time_s: float) -> tuple[float, float]:
    """Return angle [deg] and rate [deg/s] of a record of CURVE at a time of the flight."""
    own = cycles[curve.first : curve.last]
    return curve_at(own, curve.stop_s, curve.ease_in_s, curve.ease_out_s, time_s - curve.start_s)


@compiled
def curve_at(
    cycles: np.ndarray, stop_s: float, ease_in_s: float, ease_out_s: float, time_s: float
) -> tuple[float, float]:
    """Return angle [deg] and rate [deg/s] of a train at a time.

    Parameters
    ----------
    cycles : (n, 2)
        Amplitude [deg] and period [s] of each; a single row stands for cycles that are all the same.
    stop_s : float
        End of the last cycle.
    ease_in_s, ease_out_s : float
    time_s : float
        From the beginning of the first cycle.
    """
    rise, rising = eased(time_s + ease_in_s, ease_in_s)
    fall, falling = eased(stop_s + ease_out_s - time_s, ease_out_s)
    if rise == 0.0 or fall == 0.0:
        return 0.0, 0.0
    envelope, growing = rise * fall, rising * fall - rise * falling
    if len(cycles) == 1:
        pace = 2.0 * math.pi / cycles[0, 1]
        phase, amplitude, slope = pace * time_s, cycles[0, 0], 0.0
    else:
        phase, pace = _phase(cycles, stop_s, time_s)
        amplitude, slope = _blend(cycles, phase, 0)
    sin, cos = math.sin(phase), math.cos(phase)
    rate = (slope * sin + amplitude * cos) * pace * envelope + amplitude * sin * growing
    return amplitude * sin * envelope, rate


@compiled
def time_at(cycles: np.ndarray, phase: float) -> float:
    """Return the time at a phase [s]: the integral of the period over the phase."""
    time = cycles[0, 1] * phase
    for i in range(1, len(cycles)):
        part = min(max((phase - 2.0 * math.pi * i + QUARTER) / math.pi, 0.0), 1.0)
        beyond = max(0.0, phase - 2.0 * math.pi * i - QUARTER)
        time += (cycles[i, 1] - cycles[i - 1, 1]) * (math.pi * part**4 * (2.5 - 3.0 * part + part**2) + beyond)
    return time / (2.0 * math.pi)


@compiled
def _phase(cycles: np.ndarray, stop_s: float, time_s: float) -> tuple[float, float]:
    """Return phase [rad] and its rate [rad/s] at a time."""
    phase = 2.0 * math.pi * len(cycles) * time_s / stop_s
    while True:
        pace = 2.0 * math.pi / _blend(cycles, phase, 1)[0]
        step = (time_s - time_at(cycles, phase)) * pace
        phase += step
        if abs(step) < NEWTON_RAD:
            return phase, pace


@compiled
def _blend(cycles: np.ndarray, phase: float, which: int) -> tuple[float, float]:
    """Return amplitude (0) or period (1) at a phase, and its derivative [1/rad]."""
    number, last = round(phase / (2.0 * math.pi)), len(cycles) - 1
    before = cycles[min(max(number - 1, 0), last), which]
    after = cycles[min(max(number, 0), last), which]
    part = (phase - 2.0 * math.pi * number + QUARTER) / math.pi
    if part <= 0.0 or before == after:
        return (before if part <= 0.0 else after), 0.0
    if part >= 1.0:
        return after, 0.0
    share = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    slope = 30.0 * (part * (1.0 - part)) ** 2 / math.pi
    return before + share * (after - before), slope * (after - before)


@compiled
def eased(time_s: float, ease_s: float) -> tuple[float, float]:
    """Return the cubic step of a time over an easing, and its rate [1/s]."""
    part = time_s / max(ease_s, 1e-3)
    if part <= 0.0:
        return 0.0, 0.0
    if part >= 1.0:
        return 1.0, 0.0
    return part * part * (3.0 - 2.0 * part), 6.0 * part * (1.0 - part) / max(ease_s, 1e-3)
