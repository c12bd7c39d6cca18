"""A user's grid of heights: read from the ESRI ASCII text format, and smooth heights between its points."""

import hashlib
import math
from functools import cached_property
from pathlib import Path

import numpy as np

from magsim.earth import Raster, radii_of_curvature
from magsim.earth.esri import Kind, read_esri
from magsim.errors import DataError
from magsim.terrain.plane import TangentPlane

MAX_HEIGHT_M = 9_500.0
"""Heights beyond it on either side of the sea are refused."""


class Grid:
    """Heights on a regular grid, with smooth ground between the points.

    Parameters
    ----------
    raster : Raster
        Heights above mean sea level [m], in degrees of longitude and latitude, or in meters from the origin of
        ``plane``.
    plane : TangentPlane, optional
        Given where the grid is in meters.
    name : str
        For messages.
    """

    def __init__(self, raster: Raster, *, plane: TangentPlane | None = None, name: str = "terrain") -> None:
        self.name = name
        self._raster, self._plane = raster, plane

    @property
    def heights_m(self) -> np.ndarray:
        """Heights above mean sea level, (rows, columns) [m]; the first row is the southernmost."""
        return self._raster.values

    @cached_property
    def digest(self) -> str:
        """SHA-256 over its heights and their places, in hexadecimal."""
        raster = self._raster
        place = [raster.west, raster.south, raster.step, *(() if self._plane is None else self._plane.origin)]
        digest = hashlib.sha256(repr((self.heights_m.shape, place)).encode())
        digest.update(self.heights_m.astype("<f8").tobytes())
        return digest.hexdigest()

    @property
    def highest_m(self) -> float:
        """A height that the surface does not exceed [m].

        Keys's weights are 1.25 in sum of their sizes at most, so the ground between points goes beyond the middle of
        their range by at most 1.25^2 of its half.
        """
        low, high = float(self._raster.table.min()), float(self._raster.table.max())
        return 0.5 * (low + high) + 0.5 * 1.25**2 * (high - low)

    def height(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> np.ndarray:
        """Return the height above mean sea level, (...) [m].

        Raises
        ------
        DataError
            If a place lies outside the grid.
        """
        return self._lookup(lat_rad, lon_rad)[0]

    def slope(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise for each meter to the north and to the east, (...) each."""
        _, by_y, by_x = self._lookup(lat_rad, lon_rad)
        if self._plane is not None:
            return self._plane.turn(np.asarray(lat_rad), np.asarray(lon_rad), by_y, by_x)
        meridian, normal = radii_of_curvature(np.asarray(lat_rad))
        return np.degrees(by_y) / meridian, np.degrees(by_x) / (normal * np.cos(lat_rad))

    def _lookup(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return height and its slopes along y and x in the grid's own unit."""
        if self._plane is not None:
            y, x = self._plane.place(lat_rad, lon_rad)
        else:
            y, x = np.degrees(lat_rad), self._raster.turned(np.degrees(lon_rad))
        inside = self._raster.inside(y, x)
        if not np.all(inside):
            self._outside(
                np.broadcast_to(lat_rad, inside.shape)[~inside], np.broadcast_to(lon_rad, inside.shape)[~inside]
            )
        return self._raster.lookup(y, x)

    def _outside(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> None:
        raster = self._raster
        unit = "m east and north of the start" if self._plane is not None else "deg longitude and latitude"
        msg = (
            f"{self.name}: the flight leaves the terrain grid at latitude {math.degrees(lat_rad.flat[0]):.5f}, "
            f"longitude {math.degrees(lon_rad.flat[0]):.5f} deg; the grid reaches from {raster.west:g} to "
            f"{raster.east:g} and from {raster.south:g} to {raster.north:g} ({unit})"
        )
        raise DataError(msg)


def read_grid(path: Path, *, plane: TangentPlane | None = None, nodata_m: float | None = None) -> Grid:
    """Read an ESRI ASCII grid of heights.

    Parameters
    ----------
    path : Path
    plane : TangentPlane, optional
        Given where the grid is in meters east and north of its origin; else it is in degrees.
    nodata_m : float, optional
        Height of points without data; without it such points are refused.

    Returns
    -------
    Grid

    Raises
    ------
    RequestError
        If the file is not there, or anything in it is wrong; the message names file and line.
    """

    def check(values: np.ndarray, nodata: float | None) -> str:
        return _fault(values, nodata, nodata_m)

    kind = Kind("heights", check, ", or coordinates = 'local' for meters")
    return Grid(read_esri(path, kind, geographic=plane is None), plane=plane, name=str(path))


def _fault(values: np.ndarray, nodata: float | None, nodata_m: float | None) -> str:
    """Fill points without data; return what is wrong with heights, or an empty text."""
    if nodata is not None:
        empty = values == nodata
        if empty.any():
            if nodata_m is None:
                return (
                    f"value {int(empty.argmax()) + 1} is the mark of a point without data ({nodata:g}); allowed: a "
                    "grid without holes, or terrain.nodata_m, the height that stands for them"
                )
            values[empty] = nodata_m
    wrong = np.abs(values) > MAX_HEIGHT_M
    if not wrong.any():
        return ""
    at = int(wrong.argmax())
    return f"value {at + 1}: {values[at]:g} m is no height of the ground; allowed: up to {MAX_HEIGHT_M:g} m"
