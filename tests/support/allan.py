"""Allan deviation of a series, and what theory says of a Gauss-Markov process."""

import numpy as np


def allan(values: np.ndarray, rate_hz: float, window_s: float) -> float:
    """Allan deviation from neighboring means."""
    m = round(window_s * rate_hz)
    means = values[: len(values) // m * m].reshape(-1, m).mean(axis=1)
    return float(np.sqrt(0.5 * np.mean(np.diff(means) ** 2)))


def gauss_markov_allan(sigma: float, correlation_s: float, window_s: float) -> float:
    """``2 s^2 c/T (1 - c/(2 T) (3 - 4 exp(-T/c) + exp(-2 T/c)))``, its top at 1.89 c (IEEE Std 952, annex C)."""
    r = correlation_s / window_s
    inner = 1.0 - 0.5 * r * (3.0 - 4.0 * np.exp(-1.0 / r) + np.exp(-2.0 / r))
    return float(np.sqrt(2.0 * sigma**2 * r * inner))
