"""Random drift and first-order lag of instruments."""

import math

import numpy as np
from scipy import signal


def gauss_markov(
    rng: np.random.Generator, shape: tuple[int, ...], sigma: float, correlation_s: float, rate_hz: float
) -> np.ndarray:
    """First-order Gauss-Markov process, discretized exactly and begun in its stationary state.

    Parameters
    ----------
    rng : numpy.random.Generator
    shape : tuple of int
        Time along the first axis.
    sigma : float
        Standard deviation at every instant.
    correlation_s : float [s]
        Autocorrelation is ``sigma^2 exp(-|t| / correlation_s)``.
    rate_hz : float [Hz]

    Returns
    -------
    shape
    """
    step = 1.0 / (rate_hz * correlation_s)
    drive = rng.standard_normal(shape) * (sigma * math.sqrt(-math.expm1(-2.0 * step)))
    drive[0] /= math.sqrt(-math.expm1(-2.0 * step))
    return signal.lfilter([1.0], [1.0, -math.exp(-step)], drive, axis=0)


def first_order_lag(values: np.ndarray, time_constant_s: float, rate_hz: float) -> np.ndarray:
    """Pass a signal through an instrument of first order, ``T dy/dt = x - y``, at rest before the first sample.

    Parameters
    ----------
    values : (n, ...)
        Straight between its samples: for such an input the steps are exact.
    time_constant_s : float [s]
        0 changes nothing.
    rate_hz : float [Hz]

    Returns
    -------
    (n, ...)
    """
    values = np.asarray(values, dtype=float)
    if time_constant_s == 0.0:
        return values
    step = 1.0 / (rate_hz * time_constant_s)
    keep, mean = math.exp(-step), -math.expm1(-step) / step
    # The first sample is taken out so that rest is zero.
    moved = values - values[:1]
    return values[:1] + signal.lfilter([1.0 - mean, mean - keep], [1.0, -keep], moved, axis=0)
