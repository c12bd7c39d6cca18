"""The ESRI ASCII text format of regular grids, read with bounds."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim.earth.raster import Raster
from magsim.errors import RequestError
from magsim.files import first_bytes

MAX_BYTES = 256_000_000
"""Largest grid file that is read."""

MAX_POINTS = 16_000_000
"""Most points of a grid."""

MAX_LINE = 2_000_000
"""Longest line [bytes]."""

HEADER = ("ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value")


@dataclass(frozen=True)
class Kind:
    """What the values of a grid are.

    Attributes
    ----------
    word : str
        Their name in the plural, for messages.
    check : callable
        Called with the values of a line and the mark of points without data, or None; it may fill such points in place,
        and returns what is wrong with the values, or an empty text.
    else_meters : str
        What a message adds where degrees were expected and there are none.
    """

    word: str
    check: Callable[[np.ndarray, float | None], str]
    else_meters: str = ""


def read_esri(path: Path, kind: Kind, *, geographic: bool) -> Raster:
    """Read an ESRI ASCII grid.

    Parameters
    ----------
    path : Path
    kind : Kind
    geographic : bool
        The grid is in degrees of longitude and latitude, else in meters.

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
    header, first = _read_header(path, lines, kind, geographic=geographic)
    values = _read_values(path, lines, first, header, kind)
    step = header["cellsize"]
    west = header["xllcenter"] if "xllcenter" in header else header["xllcorner"] + 0.5 * step
    south = header["yllcenter"] if "yllcenter" in header else header["yllcorner"] + 0.5 * step
    return Raster(values[::-1], west, south, step)


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


def _read_header(path: Path, lines: list[bytes], kind: Kind, *, geographic: bool) -> tuple[dict[str, float], int]:
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
    _check_extent(path, found, kind, geographic=geographic)
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


def _check_extent(path: Path, found: dict[str, float], kind: Kind, *, geographic: bool) -> None:
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
            f"longitude and latitude; allowed: those{kind.else_meters}"
        )
        _refuse(path, 1, why)
    if not geographic and not max(abs(west), abs(east), abs(south), abs(north)) <= 1.0e6:
        _refuse(path, 1, "the grid reaches farther than 1000 km from the start; allowed: meters from the start point")


def _read_values(path: Path, lines: list[bytes], first: int, header: dict[str, float], kind: Kind) -> np.ndarray:
    """Read the values in the order of the file, the northernmost row first."""
    columns, rows = int(header["ncols"]), int(header["nrows"])
    out = np.empty(columns * rows)
    filled = 0
    for number, line in enumerate(lines[first:], first + 1):
        if len(line) > MAX_LINE:
            _refuse(path, number, f"the line is longer than {MAX_LINE} bytes")
        tokens = line.split()
        if filled + len(tokens) > len(out):
            _refuse(path, number, f"there are more than {columns} x {rows} {kind.word}")
        values = _values(path, number, tokens)
        wrong = kind.check(values, header.get("nodata_value"))
        if wrong:
            _refuse(path, number, wrong)
        out[filled : filled + len(values)] = values
        filled += len(values)
    if filled < len(out):
        _refuse(path, len(lines), f"the file ends after {filled} of {columns} x {rows} {kind.word}")
    return out.reshape(rows, columns)


def _values(path: Path, number: int, tokens: list[bytes]) -> np.ndarray:
    try:
        values = np.array(tokens, dtype=float) if tokens else np.empty(0)
        if np.isfinite(values).all() and not any(b"_" in token for token in tokens):
            return values
    except ValueError:
        pass
    return np.array([_number(path, number, f"value {k + 1}", token) for k, token in enumerate(tokens)])
