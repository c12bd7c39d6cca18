"""A user's grid of heights: the ESRI ASCII text format, read with bounds, and smooth heights between its points.

Between the points the surface is the bicubic convolution of Keys (1981, IEEE Trans. ASSP 29, 1153, a = -1/2): it goes
through every point, has a continuous slope, and gives back planes and parabolas exactly.
"""

import hashlib
import math
from functools import cached_property
from pathlib import Path

import numpy as np

from magsim.earth import radii_of_curvature
from magsim.errors import DataError, RequestError
from magsim.files import first_bytes
from magsim.terrain.plane import TangentPlane

MAX_BYTES = 256_000_000
"""Largest grid file that is read."""

MAX_POINTS = 16_000_000
"""Most points of a grid."""

MAX_LINE = 2_000_000
"""Longest line [bytes]."""

MAX_HEIGHT_M = 9_500.0
"""Heights beyond it on either side of the sea are refused."""

HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value")


class Grid:
    """Heights on a regular grid, with smooth ground between the points.

    Parameters
    ----------
    heights_m : (rows, columns)
        Above mean sea level; the first row is the southernmost, the first column the westernmost.
    west, south : float
        Place of the first point: degrees, or meters from the origin of ``plane``.
    step : float
        Distance of the points in the same unit.
    plane : TangentPlane, optional
        Given where the grid is in meters; without it, it is in degrees of longitude and latitude.
    name : str
        For messages.
    """

    def __init__(
        self,
        heights_m: np.ndarray,
        west: float,
        south: float,
        step: float,
        *,
        plane: TangentPlane | None = None,
        name: str = "terrain",
    ) -> None:
        self.name = name
        self._plane, self._west, self._south, self._step = plane, west, south, step
        self.heights_m = np.array(heights_m, dtype=float)
        self.heights_m.flags.writeable = False
        # One more point on each side, on the straight line of the last two.
        table = np.pad(self.heights_m, 1)
        table[0], table[-1] = 2.0 * table[1] - table[2], 2.0 * table[-2] - table[-3]
        table[:, 0], table[:, -1] = 2.0 * table[:, 1] - table[:, 2], 2.0 * table[:, -2] - table[:, -3]
        self._table = table

    @cached_property
    def digest(self) -> str:
        """SHA-256 over its heights and their places, in hexadecimal."""
        place = [self._west, self._south, self._step, *(() if self._plane is None else self._plane.origin)]
        digest = hashlib.sha256(repr((self.heights_m.shape, place)).encode())
        digest.update(self.heights_m.astype("<f8").tobytes())
        return digest.hexdigest()

    @property
    def highest_m(self) -> float:
        """A height that the surface does not exceed [m].

        Keys's weights are 1.25 in sum of their sizes at most, so the ground between points goes beyond the middle of
        their range by at most 1.25^2 of its half.
        """
        low, high = float(self._table.min()), float(self._table.max())
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
            y, x = np.degrees(lat_rad), np.degrees(lon_rad)
            # the grid's own turn of longitude, so that it may cross the date line
            x = self._west - 1e-9 + np.mod(x - self._west + 1e-9, 360.0)
        row, column = np.broadcast_arrays((y - self._south) / self._step, (x - self._west) / self._step)
        rows, columns = self.heights_m.shape
        inside = (row > -1e-6) & (row < rows - 1 + 1e-6) & (column > -1e-6) & (column < columns - 1 + 1e-6)
        if not np.all(inside):
            self._outside(
                np.broadcast_to(lat_rad, inside.shape)[~inside], np.broadcast_to(lon_rad, inside.shape)[~inside]
            )
        i = np.clip(np.floor(row).astype(int), 0, rows - 2)
        j = np.clip(np.floor(column).astype(int), 0, columns - 2)
        wy, dy = _keys(row - i)
        wx, dx = _keys(column - j)
        height, by_y, by_x = np.zeros(row.shape), np.zeros(row.shape), np.zeros(row.shape)
        for a in range(4):
            line, along = np.zeros(row.shape), np.zeros(row.shape)
            for b in range(4):
                point = self._table[i + a, j + b]
                line += wx[b] * point
                along += dx[b] * point
            height += wy[a] * line
            by_y += dy[a] * line
            by_x += wy[a] * along
        return height, by_y / self._step, by_x / self._step

    def _outside(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> None:
        rows, columns = self.heights_m.shape
        north, east = self._south + (rows - 1) * self._step, self._west + (columns - 1) * self._step
        unit = "m east and north of the start" if self._plane is not None else "deg longitude and latitude"
        msg = (
            f"{self.name}: the flight leaves the terrain grid at latitude {math.degrees(lat_rad.flat[0]):.5f}, "
            f"longitude {math.degrees(lon_rad.flat[0]):.5f} deg; the grid reaches from {self._west:g} to {east:g} "
            f"and from {self._south:g} to {north:g} ({unit})"
        )
        raise DataError(msg)


def _keys(t: np.ndarray) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Return weights of the four points around a place between the two middle ones, and their derivatives."""
    t2, t3 = t * t, t * t * t
    weights = (
        -0.5 * t3 + t2 - 0.5 * t,
        1.5 * t3 - 2.5 * t2 + 1.0,
        -1.5 * t3 + 2.0 * t2 + 0.5 * t,
        0.5 * t3 - 0.5 * t2,
    )
    slopes = (-1.5 * t2 + 2.0 * t - 0.5, 4.5 * t2 - 5.0 * t, -4.5 * t2 + 4.0 * t + 0.5, 1.5 * t2 - t)
    return weights, slopes


def read_grid(path: Path, *, plane: TangentPlane | None = None, nodata_m: float | None = None) -> Grid:
    """Read an ESRI ASCII grid.

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
    data = first_bytes(path, MAX_BYTES + 1, kind="a grid")
    if len(data) > MAX_BYTES:
        msg = f"{path}: is larger than {MAX_BYTES // 1_000_000} MB; allowed: a smaller or coarser grid"
        raise RequestError(msg)
    lines = data.splitlines()
    header, first = _read_header(path, lines, geographic=plane is None)
    heights = _read_heights(path, lines, first, header, nodata_m)
    step = header["cellsize"]
    west = header["xllcenter"] if "xllcenter" in header else header["xllcorner"] + 0.5 * step
    south = header["yllcenter"] if "yllcenter" in header else header["yllcorner"] + 0.5 * step
    return Grid(heights[::-1], west, south, step, plane=plane, name=str(path))


def _refuse(path: Path, line: int, why: str) -> None:
    msg = f"{path}:{line}: {why}"
    raise RequestError(msg)


def _show(token: bytes) -> str:
    return ascii(token[:40].decode("latin-1"))


def _number(path: Path, line: int, name: str, token: bytes) -> float:
    try:
        value = float(token)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or b"_" in token:
        _refuse(path, line, f"{name}: {_show(token)} is not a number")
    return value


def _read_header(path: Path, lines: list[bytes], *, geographic: bool) -> tuple[dict[str, float], int]:
    """Return values of the header and the index of the first line after it."""
    found: dict[str, float] = {}
    index = 0
    for index, line in enumerate(lines):
        parts = line[:MAX_LINE].split()
        if parts and not parts[0][:1].isalpha():
            break
        if parts:
            _header_line(path, index + 1, parts, found)
    if not found:
        _refuse(path, 1, "is not an ESRI ASCII grid; expected a header that begins with ncols")
    for names in (("ncols",), ("nrows",), ("xllcorner", "xllcenter"), ("yllcorner", "yllcenter"), ("cellsize",)):
        given = [name for name in names if name in found]
        if len(given) != 1:
            what = "is missing" if not given else "are both given"
            _refuse(path, index + 1, f"the header is not complete: {' or '.join(names)} {what}")
    _check_extent(path, found, geographic=geographic)
    return found, index


def _header_line(path: Path, line: int, parts: list[bytes], found: dict[str, float]) -> None:
    name = parts[0].decode("latin-1").lower()
    if name not in HEADER:
        _refuse(path, line, f"{_show(parts[0])} is no key of the header; allowed: {', '.join(HEADER)}")
    if name in found:
        _refuse(path, line, f"{name} is given twice")
    if len(parts) != 2:
        _refuse(path, line, f"{name} has {len(parts) - 1} values; allowed: 1")
    value = _number(path, line, name, parts[1])
    if name in ("ncols", "nrows") and not (value == int(value) and 2 <= value <= MAX_POINTS):
        _refuse(path, line, f"{name}: {_show(parts[1])} is not allowed; allowed: a whole number from 2")
    found[name] = value


def _check_extent(path: Path, found: dict[str, float], *, geographic: bool) -> None:
    columns, rows, step = int(found["ncols"]), int(found["nrows"]), found["cellsize"]
    if columns * rows > MAX_POINTS:
        _refuse(path, 1, f"{columns} x {rows} points are too many; allowed: up to {MAX_POINTS}")
    if not step > 0.0:
        _refuse(path, 1, f"cellsize: {step:g} is not allowed; allowed: above 0")
    west = found["xllcenter"] if "xllcenter" in found else found["xllcorner"]
    south = found["yllcenter"] if "yllcenter" in found else found["yllcorner"]
    east, north = west + columns * step, south + rows * step
    if geographic and not (
        west >= -360.0 and east <= 540.0 and east - west <= 361.0 and south >= -91.0 and north <= 91.0
    ):
        why = (
            f"the grid reaches from {west:g} to {east:g} and from {south:g} to {north:g}, which are no degrees of "
            "longitude and latitude; allowed: those, or coordinates = 'local' for meters"
        )
        _refuse(path, 1, why)
    if not geographic and not max(abs(west), abs(east), abs(south), abs(north)) <= 1.0e6:
        _refuse(path, 1, "the grid reaches farther than 1000 km from the start; allowed: meters from the start point")


def _read_heights(
    path: Path, lines: list[bytes], first: int, header: dict[str, float], nodata_m: float | None
) -> np.ndarray:
    """Read the heights in the order of the file, the northernmost row first."""
    columns, rows = int(header["ncols"]), int(header["nrows"])
    out = np.empty(columns * rows)
    filled = 0
    for number, line in enumerate(lines[first:], first + 1):
        if len(line) > MAX_LINE:
            _refuse(path, number, f"the line is longer than {MAX_LINE} bytes")
        tokens = line.split()
        if filled + len(tokens) > len(out):
            _refuse(path, number, f"there are more than {columns} x {rows} heights")
        values = _values(path, number, tokens)
        _check_heights(path, number, values, header.get("nodata_value"), nodata_m)
        out[filled : filled + len(values)] = values
        filled += len(values)
    if filled < len(out):
        _refuse(path, len(lines), f"the file ends after {filled} of {columns} x {rows} heights")
    return out.reshape(rows, columns)


def _values(path: Path, number: int, tokens: list[bytes]) -> np.ndarray:
    try:
        values = np.array(tokens, dtype=float) if tokens else np.empty(0)
        if np.isfinite(values).all() and not any(b"_" in token for token in tokens):
            return values
    except ValueError:
        pass
    return np.array([_number(path, number, f"value {k + 1}", token) for k, token in enumerate(tokens)])


def _check_heights(path: Path, number: int, values: np.ndarray, nodata: float | None, nodata_m: float | None) -> None:
    """Refuse or fill points without data; refuse heights that no ground has."""
    if nodata is not None:
        empty = values == nodata
        if empty.any():
            if nodata_m is None:
                why = (
                    f"value {int(empty.argmax()) + 1} is the mark of a point without data ({nodata:g}); allowed: a "
                    "grid without holes, or terrain.nodata_m, the height that stands for them"
                )
                _refuse(path, number, why)
            values[empty] = nodata_m
    wrong = np.abs(values) > MAX_HEIGHT_M
    if wrong.any():
        at = int(wrong.argmax())
        why = f"value {at + 1}: {values[at]:g} m is no height of the ground; allowed: up to {MAX_HEIGHT_M:g} m"
        _refuse(path, number, why)
