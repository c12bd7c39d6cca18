"""The gate that an injected anomaly must pass unharmed (reference: benchmark page, section 3)."""

import numpy as np

PEAK_NT = 20.0
SIGMAS_S = (1.0, 3.0)
"""Widths of the Gaussians in turn: the long ones have little in band."""
SPACING_S = 60.0
TOLERANCE = 0.05
"""Largest distance of the gain from 1 that passes."""


def anomaly(time_s: np.ndarray) -> np.ndarray:
    """Anomalies of a survey, one every minute: Gaussians of 20 nT, (n,) [nT]."""
    out = np.zeros(len(time_s))
    centers = np.arange(time_s[0] + SPACING_S / 2.0, time_s[-1], SPACING_S)
    for i, center in enumerate(centers):
        out += PEAK_NT * np.exp(-0.5 * ((time_s - center) / SIGMAS_S[i % len(SIGMAS_S)]) ** 2)
    return out


def gain(change: np.ndarray, injected: np.ndarray) -> float:
    """Share of an anomaly that a compensator leaves.

    Parameters
    ----------
    change : (n,) [nT]
        Band-passed difference of the compensated readings with and without the anomaly.
    injected : (n,) [nT]
        Band-passed anomaly.

    Returns
    -------
    float
        1 where nothing is taken away; NaN without an anomaly.
    """
    power = float(np.sum(injected**2))
    return float(np.sum(change * injected)) / power if power > 0.0 else float("nan")
