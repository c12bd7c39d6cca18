"""Rows that stand on every board: nothing removed, the noise floor, and two that must fail its gates.

They are made by the judge, which knows the truth where they need it.
"""

from collections.abc import Callable, Mapping

import numpy as np
from scipy import signal

from magsim import columns
from magsim.recording import Recording

LOW_PASS_HZ = 0.05

Baseline = Callable[[Recording, str], np.ndarray]
"""From a whole recording, and the name of its magnetometer, to an estimate (n,) [nT]."""


def nothing(recording: Recording, _sensor: str) -> np.ndarray:
    """Remove nothing."""
    return np.zeros(len(recording))


def noise_floor(recording: Recording, sensor: str) -> np.ndarray:
    """Remove the noise-free label: what is left is the instrument."""
    return np.asarray(recording[columns.INTERFERENCE.name(sensor=sensor)])


def constant(recording: Recording, sensor: str) -> np.ndarray:
    """Leave a constant, which the papers' scores reward and an anomaly does not survive."""
    reading = recording[columns.MAG.name(sensor=sensor)]
    return reading - reading.mean()


def low_pass(recording: Recording, sensor: str) -> np.ndarray:
    """Leave what is below 0.05 Hz."""
    reading = recording[columns.MAG.name(sensor=sensor)]
    sections = signal.butter(4, LOW_PASS_HZ, fs=recording.rate_hz, output="sos")
    return np.asarray(reading - signal.sosfiltfilt(sections, reading))


BASELINES: Mapping[str, Baseline] = {
    "none": nothing,
    "noise_floor": noise_floor,
    "constant": constant,
    "low_pass": low_pass,
}

MUST_FAIL = ("constant", "low_pass")
"""Baselines that a gate must stop."""
