"""Random errors: white noise of a given density, and noise whose power falls as 1/f."""

import math

import numpy as np

from magsim.signals import between, gauss_markov

FLICKER_HZ = 60.0
"""Rate of the grid on which 1/f noise is drawn, whatever the rate of the samples."""

FLICKER_FIRST_S = -32.0
"""Where that grid begins: before any flight's record."""

CORNERS_PER_DECADE = 2
"""Gauss-Markov processes for each decade of frequency: drawn on the grid, their sum is within 0.1 dB of 1/f from
2e-4 to 8 Hz."""

CORNERS_HZ = (1e-5, 20.0)
"""Lowest and highest corner of the processes."""


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


def flicker_noise(rng: np.random.Generator, time_s: np.ndarray, axes: int, density: float) -> np.ndarray:
    """Return 1/f noise: a function of time alone, the same at any rate of samples and for flights of any length.

    Parameters
    ----------
    rng : numpy.random.Generator
    time_s : (n,) [s]
        Increasing.
    axes : int
        Independent channels.
    density : float [unit / sqrt(Hz)]
        Root of the one-sided power spectral density at 1 Hz.

    Returns
    -------
    (n, axes) [unit]
        A sum of Gauss-Markov processes whose correlation times are spaced evenly in their logarithm, with equal
        variances ``density^2 ln(ratio)``: the sum of their Lorentzians is ``density^2 / f`` (van der Ziel, Physica 16,
        359, 1950).

    Raises
    ------
    ValueError
        If a time lies before the grid on which the noise is drawn.
    """
    if time_s[0] < FLICKER_FIRST_S + 0.5:
        msg = f"1/f noise begins at {FLICKER_FIRST_S + 0.5:g} s, asked for at {time_s[0]:g} s"
        raise ValueError(msg)
    decades = math.log10(CORNERS_HZ[1] / CORNERS_HZ[0])
    count = round(decades * CORNERS_PER_DECADE) + 1
    corners = np.geomspace(*CORNERS_HZ, count)
    sigma = density * math.sqrt(math.log(CORNERS_HZ[1] / CORNERS_HZ[0]) / (count - 1))
    rows = math.ceil((time_s[-1] - FLICKER_FIRST_S) * FLICKER_HZ) + 16
    # Each process has a generator of its own: a longer flight then begins as a shorter one does.
    total = np.zeros((rows, axes))
    for corner, child in zip(corners.tolist(), rng.spawn(count), strict=True):
        total += gauss_markov(child, (rows, axes), sigma, 1.0 / (2.0 * math.pi * corner), FLICKER_HZ)
    return between(total, (time_s - FLICKER_FIRST_S) * FLICKER_HZ)
