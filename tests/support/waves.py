"""Sines and what is left of them after a filter."""

import numpy as np

RATE = 10.0


def sine(freq_hz, rate_hz=RATE, seconds=400.0, phase=0.4):
    return np.sin(2 * np.pi * freq_hz * np.arange(0, seconds, 1 / rate_hz) + phase)


def middle(values):
    return values[len(values) // 4 : -len(values) // 4]


def amplitude(values, freq_hz, rate_hz=RATE):
    """Amplitude and phase [rad] of a sine by least squares."""
    t = np.arange(len(values)) / rate_hz
    basis = np.stack([np.sin(2 * np.pi * freq_hz * t), np.cos(2 * np.pi * freq_hz * t)], axis=1)
    a, b = np.linalg.lstsq(basis, values, rcond=None)[0]
    return np.hypot(a, b), np.arctan2(b, a)
