"""Universal Transverse Mercator on WGS-84.

Kruger's series in the third flattening (Karney, Transverse Mercator with an accuracy of a few nanometers, Journal of
Geodesy 85, 2011, equations 7 to 11 and 35), to its fourth power: below 1e-5 m within a zone.
"""

import math

import numpy as np

from magsim.earth.wgs84 import ECCENTRICITY2, FLATTENING, SEMI_MAJOR_M

SCALE = 0.9996
"""Scale on the central meridian."""

FALSE_EASTING_M, FALSE_NORTHING_M = 500_000.0, 10_000_000.0

_N = FLATTENING / (2.0 - FLATTENING)
_RECTIFYING_M = SEMI_MAJOR_M / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA = (
    _N / 2.0 - 2.0 / 3.0 * _N**2 + 5.0 / 16.0 * _N**3 + 41.0 / 180.0 * _N**4,
    13.0 / 48.0 * _N**2 - 3.0 / 5.0 * _N**3 + 557.0 / 1440.0 * _N**4,
    61.0 / 240.0 * _N**3 - 103.0 / 140.0 * _N**4,
    49561.0 / 161280.0 * _N**4,
)


def utm_zone(lat_deg: float, lon_deg: float) -> int:
    """Return the number of the zone of a position, 1 to 60, with the exceptions of Norway and Svalbard."""
    lon = (lon_deg + 180.0) % 360.0 - 180.0
    if 56.0 <= lat_deg < 64.0 and 3.0 <= lon < 12.0:
        return 32
    if 72.0 <= lat_deg <= 84.0 and 0.0 <= lon < 42.0:
        return 31 + 2 * int((lon + 3.0) // 12.0)
    return min(60, int((lon + 180.0) // 6.0) + 1)


def utm(lat_rad: np.ndarray, lon_rad: np.ndarray, *, zone: int, south: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return easting and northing in a zone.

    Parameters
    ----------
    lat_rad, lon_rad : (...) [rad]
        WGS-84 (geodetic) latitude and longitude, within some tens of degrees of the zone.
    zone : int
        1 to 60.
    south : bool
        Northing of the southern hemisphere.

    Returns
    -------
    easting, northing : (...) [m]
    """
    central = math.radians(6.0 * zone - 183.0)
    lon = (np.asarray(lon_rad) - central + math.pi) % (2.0 * math.pi) - math.pi
    root = math.sqrt(ECCENTRICITY2)
    sine = np.sin(lat_rad)
    tangent = np.sinh(np.arctanh(sine) - root * np.arctanh(root * sine))  # of the conformal latitude
    xi = np.arctan2(tangent, np.cos(lon))
    eta = np.arcsinh(np.sin(lon) / np.hypot(tangent, np.cos(lon)))
    plain = xi + 1j * eta
    curved = plain + sum(a * np.sin(2.0 * j * plain) for j, a in enumerate(_ALPHA, start=1))
    meters = SCALE * _RECTIFYING_M * curved
    return FALSE_EASTING_M + meters.imag, meters.real + (FALSE_NORTHING_M if south else 0.0)
