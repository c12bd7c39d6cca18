"""The ICAO standard atmosphere below 11 km, for limits and estimates; flights get their air from JSBSim."""

import numpy as np

from magsim.units import RHO0


def standard_density(alt_m: float | np.ndarray) -> float | np.ndarray:
    """Density [kg/m^3] at a height [m] (ICAO Doc 7488: lapse rate 6.5 K/km)."""
    return RHO0 * (1.0 - 0.0065 * alt_m / 288.15) ** 4.2558797
