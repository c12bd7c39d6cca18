"""The plane in which a path is drawn."""

import math

import numpy as np

from magsim.earth.wgs84 import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at
from magsim.storage.compiled import compiled


class LocalPlane:
    """Plane that touches a surface of constant height at a point: x north, y east there [m].

    A distance d from the point appears shorter by d^3 / (6 R^2): 0.7 m at 30 km, none at 10 km.

    Attributes
    ----------
    table : (10,)
        For ``motion_in_plane``: the point, the directions of x and y, Earth-fixed, and the height.
    """

    def __init__(self, lat_rad: float, lon_rad: float, alt_m: float) -> None:
        self.lat_rad, self.lon_rad, self.alt_m = lat_rad, lon_rad, alt_m
        self._origin = [float(v) for v in ecef_from_geodetic(lat_rad, lon_rad, alt_m)]
        rot_ne = rot_ne_at(lat_rad, lon_rad)
        self._north, self._east, self._down = ([float(v) for v in axis] for axis in rot_ne)
        self.table = np.array([*self._origin, *self._north, *self._east, alt_m])

    def place(self, lat_rad: float, lon_rad: float) -> tuple[float, float]:
        """Return north and east [m] of a place at the plane's height."""
        return self.motion(lat_rad, lon_rad, 0.0, 0.0)[:2]

    def motion(self, lat_rad: float, lon_rad: float, north: float, east: float) -> tuple[float, float, float, float]:
        """Return position [m] and horizontal velocity [m/s] in the plane from those on the ellipsoid."""
        return motion_in_plane(self.table, lat_rad, lon_rad, north, east)

    def geodetic(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Return latitude and longitude [rad] of a place of the plane, at the plane's height.

        The place is the intersection of the plane's perpendicular with the surface of constant height; each iteration
        moves along the perpendicular by the remaining height error.
        """
        up = [-d for d in self._down]
        above = 0.0
        for _ in range(8):
            point = [
                o + north_m * n + east_m * e + above * u
                for o, n, e, u in zip(self._origin, self._north, self._east, up, strict=True)
            ]
            lat, lon, alt = (float(v) for v in geodetic_from_ecef(np.array(point)))
            above += self.alt_m - alt
        return lat, lon

    def north_at(self, lat_rad: float, lon_rad: float) -> float:
        """Return the direction of local north in the plane [rad], clockwise from the plane's north; 0 at its origin."""
        north, east = self.motion(lat_rad, lon_rad, 1.0, 0.0)[2:]
        return math.atan2(east, north)


@compiled
def motion_in_plane(
    plane: np.ndarray, lat_rad: float, lon_rad: float, north: float, east: float
) -> tuple[float, float, float, float]:
    """Return position [m] and horizontal velocity [m/s] in a plane from those on the ellipsoid.

    Parameters
    ----------
    plane : (10,)
        ``LocalPlane.table``.
    lat_rad, lon_rad : float
    north, east : float [m/s]
    """
    sl, cl, so, co = math.sin(lat_rad), math.cos(lat_rad), math.sin(lon_rad), math.cos(lon_rad)
    normal = 6378137.0 / math.sqrt(1.0 - 6.69437999014e-3 * sl * sl)
    radius = (normal + plane[9]) * cl
    dx, dy = radius * co - plane[0], radius * so - plane[1]
    dz = (normal * (1.0 - 6.69437999014e-3) + plane[9]) * sl - plane[2]
    vx, vy, vz = -north * sl * co - east * so, -north * sl * so + east * co, north * cl
    return (
        plane[3] * dx + plane[4] * dy + plane[5] * dz,
        plane[6] * dx + plane[7] * dy + plane[8] * dz,
        plane[3] * vx + plane[4] * vy + plane[5] * vz,
        plane[6] * vx + plane[7] * vy + plane[8] * vz,
    )
