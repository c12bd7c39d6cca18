"""The sea: the spectrum of its waves, and how strong a field their currents leave above it."""

import math

import numpy as np

from magsim.units import G0, MU0

SHORTEST, LONGEST = 2.5, 0.6
"""Frequencies of the waves over that of the peak, from the longest to the shortest; beyond is 1 % of the power."""


def jonswap(ratio: np.ndarray, gamma: float) -> np.ndarray:
    """Return the JONSWAP spectrum over the frequency in units of that of its peak, up to a factor.

    Hasselmann et al. (1973), Deutsche Hydrographische Zeitschrift, Ergänzungsheft 8-12.
    """
    width = np.where(ratio <= 1.0, 0.07, 0.09)
    return ratio**-5.0 * np.exp(-1.25 * ratio**-4.0) * gamma ** np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)


def swell_rms_nt(
    above_m: float, *, height_m: float, period_s: float, gamma: float, conductivity_spm: float, main_nt: float
) -> float:
    """Return the root mean square of the scalar anomaly of a swell at a height [nT], in a vertical main field.

    A wave of amplitude ``a`` and angular frequency ``omega`` in deep water leaves ``a mu0 sigma g F / (4 omega)`` at
    the surface (Lilley et al. 2004, Geophysical Journal International 159, 565), and ``exp(-k h)`` of it above.

    Parameters
    ----------
    above_m : float
        Above the sea [m].
    height_m, period_s, gamma, conductivity_spm : float
        Keys of a scenario's ``[field.swell]``; ``gamma`` is its ``peak``.
    main_nt : float
        Strength of the main field [nT].
    """
    ratio = np.linspace(LONGEST, SHORTEST, 400)
    power = jonswap(ratio, gamma)
    rate = 2.0 * math.pi / period_s * ratio
    size = MU0 * conductivity_spm * G0 * main_nt / (4.0 * rate) * np.exp(-(rate**2) / G0 * above_m)
    return 0.25 * height_m * math.sqrt(float(np.average(size**2, weights=power)))  # the variance is height^2 / 16
