"""The WGS-84 ellipsoid: geodetic and Earth-centered positions, local axes, radii of curvature.

Formulas: NIMA TR8350.2 (WGS 84 definition), and Bowring's iteration for the inverse.
"""

import numpy as np

SEMI_MAJOR_M = 6378137.0
"""Equatorial radius [m]."""

FLATTENING = 1.0 / 298.257223563
"""Flattening."""

ECCENTRICITY2 = FLATTENING * (2.0 - FLATTENING)
"""First eccentricity, squared."""

SEMI_MINOR_M = SEMI_MAJOR_M * (1.0 - FLATTENING)
"""Polar radius [m]."""


def radii_of_curvature(lat_rad: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Return the radii of the ellipsoid at a latitude, along the meridian and across it.

    Parameters
    ----------
    lat_rad : (...) [rad]
        Geodetic latitude.

    Returns
    -------
    meridian, normal : (...) [m]
        A step north by ``d`` meters at height ``h`` turns the latitude by ``d / (meridian + h)``; a step east turns
        the longitude by ``d / ((normal + h) cos(lat))``.
    """
    root = np.sqrt(1.0 - ECCENTRICITY2 * np.sin(lat_rad) ** 2)
    return SEMI_MAJOR_M * (1.0 - ECCENTRICITY2) / root**3, SEMI_MAJOR_M / root


def ecef_from_geodetic(
    lat_rad: np.ndarray | float, lon_rad: np.ndarray | float, alt_m: np.ndarray | float
) -> np.ndarray:
    """Return the Earth-centered Earth-fixed position.

    Parameters
    ----------
    lat_rad, lon_rad : (...) [rad]
        Geodetic latitude and longitude.
    alt_m : (...) [m]
        Height above the ellipsoid. The three broadcast.

    Returns
    -------
    (..., 3) [m]
    """
    lat, lon, alt = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (lat_rad, lon_rad, alt_m)))
    _, normal = radii_of_curvature(lat)
    across = (normal + alt) * np.cos(lat)
    along = (normal * (1.0 - ECCENTRICITY2) + alt) * np.sin(lat)
    return np.stack([across * np.cos(lon), across * np.sin(lon), along], axis=-1)


def geodetic_from_ecef(position_e: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the geodetic position of Earth-centered Earth-fixed coordinates.

    Two passes of Bowring's formula: 2e-14 degree and 1e-8 m for heights of -0.5 to 20 km; a third pass
    keeps that up to satellites.

    Parameters
    ----------
    position_e : (..., 3) [m]

    Returns
    -------
    lat_rad, lon_rad : (...) [rad]
        Longitude in (-pi, pi]; 0 on the polar axis.
    alt_m : (...) [m]
        Height above the ellipsoid.
    """
    x, y, z = np.moveaxis(np.asarray(position_e, dtype=float), -1, 0)
    p = np.sqrt(x * x + y * y)
    second = ECCENTRICITY2 / (1.0 - ECCENTRICITY2)
    # Angles as sine and cosine, up to a common factor: tan(beta) = (1 - f) tan(lat).
    sin, cos = SEMI_MAJOR_M * z, SEMI_MINOR_M * p
    for _ in range(3):
        length = np.sqrt(sin * sin + cos * cos)
        sin, cos = sin / length, cos / length
        up = z + second * SEMI_MINOR_M * sin**3
        across = p - ECCENTRICITY2 * SEMI_MAJOR_M * cos**3
        sin, cos = (1.0 - FLATTENING) * up, across
    length = np.sqrt(up * up + across * across)
    sin_lat, cos_lat = up / length, across / length
    alt = p * cos_lat + z * sin_lat - SEMI_MAJOR_M * np.sqrt(1.0 - ECCENTRICITY2 * sin_lat**2)
    return np.arctan2(up, across), np.arctan2(y, x), alt


def rot_ne_at(lat_rad: np.ndarray | float, lon_rad: np.ndarray | float) -> np.ndarray:
    """Return the rotation from Earth-fixed to local north-east-down axes: ``v_n = rot_ne @ v_e``.

    Parameters
    ----------
    lat_rad, lon_rad : (...) [rad]
        Geodetic latitude and longitude; they broadcast.

    Returns
    -------
    (..., 3, 3)
        The rows are the north, east and down unit vectors in Earth-fixed axes.
    """
    lat, lon = np.broadcast_arrays(np.asarray(lat_rad, dtype=float), np.asarray(lon_rad, dtype=float))
    sp, cp, sl, cl = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    rot = np.empty((*lat.shape, 3, 3))
    rot[..., 0, 0] = -sp * cl
    rot[..., 0, 1] = -sp * sl
    rot[..., 0, 2] = cp
    rot[..., 1, 0] = -sl
    rot[..., 1, 1] = cl
    rot[..., 1, 2] = 0.0
    rot[..., 2, 0] = -cp * cl
    rot[..., 2, 1] = -cp * sl
    rot[..., 2, 2] = -sp
    return rot


def quaternion_en_at(lat_rad: np.ndarray | float, lon_rad: np.ndarray | float) -> np.ndarray:
    """Return the quaternion of the rotation from local to Earth-fixed axes, the inverse of ``rot_ne_at``.

    Parameters
    ----------
    lat_rad, lon_rad : (...) [rad]
        Geodetic latitude and longitude; they broadcast.

    Returns
    -------
    (..., 4)
        Scalar first: longitude about z, then -(90 degrees + latitude) about y.
    """
    lat, lon = np.broadcast_arrays(np.asarray(lat_rad, dtype=float), np.asarray(lon_rad, dtype=float))
    tip, turn = -0.5 * (lat + 0.5 * np.pi), 0.5 * lon
    st, ct, sl, cl = np.sin(tip), np.cos(tip), np.sin(turn), np.cos(turn)
    return np.stack([cl * ct, -sl * st, cl * st, sl * ct], axis=-1)


def transport_rate(lat_rad: np.ndarray, alt_m: np.ndarray, velocity_n: np.ndarray) -> np.ndarray:
    """Return the angular rate of the local north-east-down axes over the Earth, in these axes.

    Parameters
    ----------
    lat_rad : (n,) [rad]
    alt_m : (n,) [m]
    velocity_n : (n, 3) [m/s]

    Returns
    -------
    (n, 3) [rad/s]
        Groves, Principles of GNSS, eq. 5.44.
    """
    meridian, normal = radii_of_curvature(lat_rad)
    north, east = velocity_n[:, 0], velocity_n[:, 1]
    along = east / (normal + alt_m)
    return np.stack([along, -north / (meridian + alt_m), -along * np.tan(lat_rad)], axis=-1)
