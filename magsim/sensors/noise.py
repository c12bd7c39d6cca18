"""Random errors: white noise of a given density, and exponentially correlated drift."""

import math

import numpy as np
from scipy.signal import lfilter


def white_noise(rng: np.random.Generator, shape: tuple[int, ...], density: float, rate_hz: float) -> np.ndarray:
    """White noise of a given one-sided amplitude density.

    Parameters
    ----------
    rng : numpy.random.Generator
    shape : tuple of int
        Time along the first axis.
    density : float [unit / sqrt(Hz)]
        Root of the one-sided power spectral density.
    rate_hz : float [Hz]
        Sample rate; the noise fills 0 to half of it.

    Returns
    -------
    shape [unit]
        With standard deviation ``density sqrt(rate / 2)``.
    """
    return rng.standard_normal(shape) * (density * math.sqrt(rate_hz / 2.0))


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
    return lfilter([1.0], [1.0, -math.exp(-step)], drive, axis=0)
