"""A map of magnetic anomalies: an ESRI ASCII grid, smooth between its points, continued to the heights flown.

A potential field in a source-free space at height ``z`` above its grid is that of the grid with each wavenumber ``k``
damped by ``exp(-k z)`` (Blakely, Potential Theory in Gravity and Magnetic Applications, 1995, section 12.1). The total
field anomaly is continued as such, since it is nearly one component of the field.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim.earth import Raster, radii_of_curvature
from magsim.earth.esri import Kind, read_esri
from magsim.errors import DataError

MAX_ANOMALY_NT = 200_000.0
"""Larger values are none of this planet; nulls of other programs (-1e32, 1e30) lie beyond it."""

MOST_DOWN = 1.0
"""Deepest continuation downward, in cells: the shortest wave of the grid, two cells long, grows by exp(pi) there."""

MARGIN_CELLS = 12
"""Cells around the flight that take part in a continuation, and five times the height of the continuation."""


@dataclass(frozen=True)
class AnomalyMap:
    """Anomalies of the total field on a grid.

    Attributes
    ----------
    raster : Raster
        Values [nT] over degrees of longitude and latitude; NaN where the map has none.
    height_m : float [m], optional
        Height above the WGS-84 ellipsoid that the map is of. Without it the map is taken for that of the heights that
        were flown (a drape).
    name : str
        For messages.
    """

    raster: Raster
    height_m: float | None = None
    name: str = "map"

    @classmethod
    def read(cls, path: Path, height_m: float | None = None) -> "AnomalyMap":
        """Read an ESRI ASCII grid in degrees.

        Raises
        ------
        RequestError
            If it cannot be read, with file and line.
        """
        kind = Kind("anomalies", _fault)
        return cls(read_esri(path, kind, geographic=True), height_m, str(path))

    def at(self, lat_deg: np.ndarray, lon_deg: np.ndarray, alt_m: np.ndarray, flight: str) -> np.ndarray:
        """Return the anomaly along a flight, (n,) [nT].

        Parameters
        ----------
        lat_deg, lon_deg : (n,) [deg]
        alt_m : (n,) [m]
            Above the WGS-84 ellipsoid.
        flight : str
            Name of the recording, for messages.

        Raises
        ------
        DataError
            If the flight leaves the map, crosses a hole in it, or is too far below its height.
        """
        raster, lon = self.raster, self.raster.turned(lon_deg)
        inside = raster.inside(lat_deg, lon)
        if not inside.all():
            at = int(np.argmin(inside))
            msg = (
                f"{self.name}: recording {flight!r} leaves the map at latitude {lat_deg[at]:.5f}, longitude "
                f"{lon_deg[at]:.5f} deg; the map reaches from {raster.west:g} to {raster.east:g} and from "
                f"{raster.south:g} to {raster.north:g} (deg longitude and latitude)"
            )
            raise DataError(msg)
        if self.height_m is None:
            return self._whole(raster.lookup(lat_deg, lon)[0], flight)
        return self._continued(lat_deg, lon, alt_m - self.height_m, flight)

    def _continued(self, lat_deg: np.ndarray, lon: np.ndarray, up_m: np.ndarray, flight: str) -> np.ndarray:
        """Return the anomaly at heights above the map, (n,) [nT]: a polynomial through that of some heights."""
        low, high = float(up_m.min()), float(up_m.max())
        cell_m = self._cell_m(float(lat_deg.mean()))
        if low < -MOST_DOWN * min(cell_m):
            msg = (
                f"{self.name}: recording {flight!r} goes {-low:.0f} m below the map's height of {self.height_m:g} m; "
                f"allowed: {MOST_DOWN * min(cell_m):.0f} m, one cell, since noise grows without bound downward; a map "
                "of a lower height would do"
            )
            raise DataError(msg)
        part = self._around(lat_deg, lon, max(abs(low), abs(high)), cell_m)
        self._whole(part.values, flight)
        count = 5 + 2 * math.ceil((high - low) / min(cell_m))
        # Chebyshev's points and the weights of Lagrange's polynomial through them (Berrut and Trefethen, SIAM Review
        # 2004, 46, 501-517, eq. 4.2 and 5.4)
        angle = (np.arange(count) + 0.5) * np.pi / count
        levels = 0.5 * (low + high) + 0.5 * max(high - low, 1e-3) * np.cos(angle)
        weights = (-1.0) ** np.arange(count) * np.sin(angle)
        away = up_m[:, None] - levels
        away[away == 0.0] = 1e-12
        shares = weights / away
        values = np.column_stack([_up(part, level, cell_m).lookup(lat_deg, lon)[0] for level in levels])
        return np.einsum("nl,nl->n", shares, values) / shares.sum(axis=1)

    def _cell_m(self, lat_deg: float) -> tuple[float, float]:
        """Return the size of a cell to the north and to the east [m]."""
        meridian, normal = radii_of_curvature(np.array(np.radians(lat_deg)))
        step = math.radians(self.raster.step)
        return float(meridian) * step, float(normal) * math.cos(math.radians(lat_deg)) * step

    def _around(self, lat_deg: np.ndarray, lon: np.ndarray, up_m: float, cell_m: tuple[float, float]) -> Raster:
        """Return the part of the grid that a continuation by some height needs."""
        raster, bounds = self.raster, []
        for places, start, count, size in zip(
            (lat_deg, lon), (raster.south, raster.west), raster.values.shape, cell_m, strict=True
        ):
            margin = MARGIN_CELLS + math.ceil(5.0 * up_m / size)
            first = max(math.floor((float(places.min()) - start) / raster.step) - margin, 0)
            last = min(math.ceil((float(places.max()) - start) / raster.step) + margin, count - 1)
            bounds.append((first, last))
        (south, north), (west, east) = bounds
        values = raster.values[south : north + 1, west : east + 1]
        return Raster(values, raster.west + west * raster.step, raster.south + south * raster.step, raster.step)

    def _whole(self, values: np.ndarray, flight: str) -> np.ndarray:
        if np.isnan(values).any():
            msg = (
                f"{self.name}: recording {flight!r} flies over or near points without data; allowed: a map without "
                "holes there"
            )
            raise DataError(msg)
        return values


def _up(part: Raster, up_m: float, cell_m: tuple[float, float]) -> Raster:
    """Return a grid continued upward; it is mirrored at its edges, so that nothing jumps where it repeats itself."""
    rows, columns = part.values.shape
    mean = part.values.mean()
    whole = np.block([[part.values, part.values[:, ::-1]], [part.values[::-1], part.values[::-1, ::-1]]]) - mean
    north = 2.0 * np.pi * np.fft.fftfreq(2 * rows, cell_m[0])
    east = 2.0 * np.pi * np.fft.rfftfreq(2 * columns, cell_m[1])
    damping = np.exp(-up_m * np.hypot(north[:, None], east))
    values = np.fft.irfft2(np.fft.rfft2(whole) * damping, s=whole.shape)[:rows, :columns]
    return Raster(values + mean, part.west, part.south, part.step)


def _fault(values: np.ndarray, nodata: float | None) -> str:
    """Mark points without data with NaN; return what is wrong with the others, or an empty text."""
    if nodata is not None:
        values[values == nodata] = np.nan
    wrong = np.abs(values) > MAX_ANOMALY_NT
    if not wrong.any():
        return ""
    at = int(wrong.argmax())
    return (
        f"value {at + 1}: {values[at]:g} nT is no anomaly; allowed: up to {MAX_ANOMALY_NT:g} nT, and nodata_value in "
        "the header for points without data"
    )
