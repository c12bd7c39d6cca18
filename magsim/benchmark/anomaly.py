"""The anomaly that is injected into the reading: a compensator must leave it unharmed."""

import numpy as np

PEAK_NT = 20.0
SIGMAS_S = (1.0, 3.0)
"""Widths of the Gaussians in turn: the long ones have little in band."""
SPACING_S = 60.0


def anomaly(time_s: np.ndarray) -> np.ndarray:
    """Return the anomalies of a survey, one every minute: Gaussians of 20 nT, (n,) [nT]."""
    out = np.zeros(len(time_s))
    centers = np.arange(time_s[0] + SPACING_S / 2.0, time_s[-1], SPACING_S)
    for i, center in enumerate(centers):
        out += PEAK_NT * np.exp(-0.5 * ((time_s - center) / SIGMAS_S[i % len(SIGMAS_S)]) ** 2)
    return out
