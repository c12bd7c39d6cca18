"""Random errors: white noise of a given density."""

import math

import numpy as np


def white_noise(rng: np.random.Generator, shape: tuple[int, ...], density: float, rate_hz: float) -> np.ndarray:
    """Return white noise of a given one-sided amplitude density.

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
