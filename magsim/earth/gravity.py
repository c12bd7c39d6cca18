"""Gravity of the WGS-84 ellipsoid: mass and spin of the Earth without its mountains."""

import numpy as np

from magsim.earth.wgs84 import ECCENTRICITY2, FLATTENING, SEMI_MAJOR_M, SEMI_MINOR_M

SPIN_RADPS = 7.292115e-5
"""Angular rate of the Earth [rad/s] (WGS 84, NGA.STND.0036, table 3.1)."""

GM_M3PS2 = 3.986004418e14
"""Gravitational constant times mass of the Earth (the same table)."""

EQUATOR_MPS2, POLE_MPS2 = 9.7803253359, 9.8321849379
"""Normal gravity on the ellipsoid (the same standard, table 3.6)."""


def gravity_n(lat_rad: np.ndarray | float, alt_m: np.ndarray | float) -> np.ndarray:
    """Return normal gravity, which includes the centrifugal acceleration.

    Parameters
    ----------
    lat_rad : (...) [rad]
        Geodetic.
    alt_m : (...) [m]
        Above the ellipsoid. The two broadcast. Up to 10 km the series is accurate to 1e-6 m/s^2.

    Returns
    -------
    (..., 3) [m/s^2]
        North, east, down. Somigliana's formula and its series in the height (Heiskanen and Moritz, Physical Geodesy,
        eq. 2-123); plumb lines bend, hence the north component (Groves, Principles of GNSS, eq. 2.140).
    """
    lat, alt = np.broadcast_arrays(np.asarray(lat_rad, dtype=float), np.asarray(alt_m, dtype=float))
    sin2 = np.sin(lat) ** 2
    k = SEMI_MINOR_M * POLE_MPS2 / (SEMI_MAJOR_M * EQUATOR_MPS2) - 1.0
    surface = EQUATOR_MPS2 * (1.0 + k * sin2) / np.sqrt(1.0 - ECCENTRICITY2 * sin2)
    m = SPIN_RADPS**2 * SEMI_MAJOR_M**2 * SEMI_MINOR_M / GM_M3PS2
    h = alt / SEMI_MAJOR_M
    down = surface * (1.0 - 2.0 * (1.0 + FLATTENING + m - 2.0 * FLATTENING * sin2) * h + 3.0 * h**2)
    north = -8.08e-9 * alt * np.sin(2.0 * lat)
    return np.stack([north, np.zeros_like(down), down], axis=-1)
