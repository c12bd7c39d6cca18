"""The ICAO standard atmosphere up to 20 km (ICAO Doc 7488, ISO 2533): for instruments, limits and estimates.

Flights get their air from JSBSim. Heights of the standard are geopotential: ``geopotential_height`` converts heights
above mean sea level.
"""

from typing import overload

import numpy as np

from magsim.units import G0, RHO0

SEA_LEVEL_PA = 101325.0
"""Pressure at height 0 [Pa]."""

RADIUS_M = 6356766.0
"""Radius by which geopotential heights are defined [m]."""

_SEA_LEVEL_K, _LAPSE = 288.15, 0.0065
_GAS = 287.05287
"""Specific gas constant of air [J/(kg K)]."""
_TROPOPAUSE_M = 11000.0
_TROPOPAUSE_K = _SEA_LEVEL_K - _LAPSE * _TROPOPAUSE_M
_POWER = G0 / (_GAS * _LAPSE)
_TROPOPAUSE_PA = SEA_LEVEL_PA * (_TROPOPAUSE_K / _SEA_LEVEL_K) ** _POWER
_SCALE_M = _GAS * _TROPOPAUSE_K / G0


def standard_density(alt_m: float | np.ndarray) -> float | np.ndarray:
    """Return the density [kg/m^3] at a height below 11 km [m] (ICAO Doc 7488: lapse rate 6.5 K/km)."""
    return RHO0 * (1.0 - _LAPSE * alt_m / _SEA_LEVEL_K) ** 4.2558797


@overload
def standard_temperature_c(height_m: float) -> float: ...
@overload
def standard_temperature_c(height_m: np.ndarray) -> np.ndarray: ...
def standard_temperature_c(height_m: float | np.ndarray) -> float | np.ndarray:
    """Return the temperature [degC] at a geopotential height [m], constant above the tropopause."""
    return _SEA_LEVEL_K - _LAPSE * np.minimum(height_m, _TROPOPAUSE_M) - 273.15


def geopotential_height(height_m: np.ndarray) -> np.ndarray:
    """Return the geopotential height of heights above mean sea level, (n,) [m]; at 4 km it is 2.4 m less."""
    return RADIUS_M * height_m / (RADIUS_M + height_m)


def standard_pressure(height_m: np.ndarray) -> np.ndarray:
    """Return the pressure of the standard atmosphere.

    Parameters
    ----------
    height_m : (n,) [m]
        Geopotential; up to 20 000.

    Returns
    -------
    (n,) [Pa]
    """
    height_m = np.asarray(height_m, dtype=float)
    below = np.minimum(height_m, _TROPOPAUSE_M)
    warm = SEA_LEVEL_PA * (1.0 - _LAPSE * below / _SEA_LEVEL_K) ** _POWER
    return warm * np.exp((below - height_m) / _SCALE_M)


def pressure_altitude(pressure_pa: np.ndarray | float) -> np.ndarray:
    """Return the geopotential height of a pressure in the standard atmosphere, (n,) [Pa] to (n,) [m]."""
    pressure_pa = np.asarray(pressure_pa, dtype=float)
    below = _SEA_LEVEL_K / _LAPSE * (1.0 - (np.maximum(pressure_pa, _TROPOPAUSE_PA) / SEA_LEVEL_PA) ** (1.0 / _POWER))
    return below - _SCALE_M * np.log(np.minimum(pressure_pa / _TROPOPAUSE_PA, 1.0))
