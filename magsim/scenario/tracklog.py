"""Reading a logged track: bounded and strict; every problem is reported with file, line and column."""

import csv
import hashlib
import math
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path

import numpy as np

from magsim.aircraft import Aircraft
from magsim.arrays import readonly
from magsim.earth import radii_of_curvature
from magsim.errors import DataError, MagsimError, RequestError
from magsim.scenario.track import COUNTED, TrackPattern
from magsim.storage.hdf5 import open_untrusted

MAX_BYTES = 1_000_000_000
"""Largest track file that is read."""

MAX_ROWS = 2_000_000
"""Most rows of a track."""

MAX_PROBLEMS = 20
"""Most problems of one file that are reported."""

SHORTEST_S = 20.0
"""Shortest track: 4 s at either end are run-in of filters."""

FASTEST_MPS = 400.0
FASTEST_TURN_DPS = 400.0
"""Steps between rows beyond these are mistakes: a wrong unit, or rows that do not belong together."""

Reason = Callable[[int], str]
"""Text of what is wrong with a row."""

Finder = Callable[[str, np.ndarray, Reason], Iterator[str]]
"""Yields the first wrong row of a quantity with its place in the file."""

HDF5_SUFFIXES = (".h5", ".hdf5", ".he5")


class TrackProblemsError(RequestError):
    """Everything that is wrong with a track file, one line each."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = tuple(lines)
        super().__init__("\n".join(lines))


@dataclass(frozen=True)
class TrackLog:
    """A track as it was logged, in SI units.

    Attributes
    ----------
    values : dict of str to (n,)
        Quantities of ``magsim.scenario.track.KINDS``; heading not unwrapped, in radians.
    """

    values: dict[str, np.ndarray]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", {name: readonly(value) for name, value in self.values.items()})

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the quantities, in hexadecimal."""
        digest = hashlib.sha256()
        for name in sorted(self.values):
            digest.update(f"{name}\0".encode() + self.values[name].astype("<f8").tobytes())
        return digest.hexdigest()

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def __len__(self) -> int:
        return len(self.values["time"])


def read_track(settings: TrackPattern, folder: Path) -> TrackLog:
    """Read the file of a track.

    Parameters
    ----------
    settings : TrackPattern
    folder : Path
        Where the scenario lies; the file's path begins there.

    Returns
    -------
    TrackLog

    Raises
    ------
    TrackProblemsError
        If the file cannot be read or anything in it is wrong.
    """
    path = folder / settings.file
    try:
        size = path.stat().st_size if path.is_file() else -1
    except (OSError, ValueError) as error:
        raise TrackProblemsError([f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]) from None
    if size < 0:
        what = "is not a regular file" if path.exists() else "there is no such file"
        raise TrackProblemsError([f"{path}: {what}"])
    if size > MAX_BYTES:
        raise TrackProblemsError([f"{path}: is larger than {MAX_BYTES // 1_000_000} MB; allowed: a part of the log"])
    used = settings.columns.used()
    table = _from_hdf5(path, used) if path.suffix.lower() in HDF5_SUFFIXES else _from_csv(path, used, settings)
    table = _cut(path, table, settings)
    problems = list(_problems(path, table, settings))
    if problems:
        raise TrackProblemsError(problems)
    return TrackLog(table.values)


@dataclass(frozen=True)
class _TrackTable:
    """Columns in SI units, and where each row stands in the file."""

    values: dict[str, np.ndarray]
    names: dict[str, str]
    lines: np.ndarray | None

    def where(self, path: Path, row: int) -> str:
        return f"{path}: row {row + 1}" if self.lines is None else f"{path}:{self.lines[row]}"


def _from_hdf5(path: Path, used: dict[str, tuple[str, float]]) -> _TrackTable:
    values, problems = {}, []
    try:
        with open_untrusted(path) as root:
            for quantity, (name, factor) in used.items():
                try:
                    values[quantity] = _data_set(root, name) * factor
                except MagsimError as error:
                    problems.append(str(error))
    except (DataError, RequestError) as error:
        raise TrackProblemsError([str(error)]) from None
    if problems:
        raise TrackProblemsError(problems)
    lengths = {quantity: len(column) for quantity, column in values.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{used[quantity][0]} {length}" for quantity, length in lengths.items())
        raise TrackProblemsError([f"{path}: the data sets differ in length: {found}"])
    if lengths["time"] > MAX_ROWS:
        raise TrackProblemsError([f"{path}: has more than {MAX_ROWS} rows; allowed: a part of the log"])
    return _TrackTable(values, {quantity: name for quantity, (name, _) in used.items()}, None)


def _data_set(root: object, name: str) -> np.ndarray:
    """Return one-dimensional numbers of any kind; groups in the name are separated by slashes."""
    *groups, last = name.strip("/").split("/")
    for group in groups:
        root = root.group(group)  # type: ignore[attr-defined]
    first: MagsimError | None = None
    for kind in "fiu":
        try:
            return np.asarray(root.array(last, kind=kind, ndim=1), dtype=float)  # type: ignore[attr-defined]
        except MagsimError as error:
            first = first or error
    assert first is not None  # else it had returned
    raise first


def _from_csv(path: Path, used: dict[str, tuple[str, float]], settings: TrackPattern) -> _TrackTable:
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise TrackProblemsError([f"{path}:{line}: is not UTF-8 text (byte 0x{data[error.start]:02x})"]) from None
    del data
    rows = _rows(path, text, settings.delimiter)
    line, header = next(rows, (0, []))
    if not header:
        raise TrackProblemsError([f"{path}: has no header line; allowed: names of columns, then rows"])
    places = _places(path, line, [name.strip() for name in header], used)
    return _parse(path, rows, len(header), places, used=used, settings=settings)


def _rows(path: Path, text: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and fields of each line that is neither empty nor a comment."""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            yield number, next(csv.reader([line], delimiter=delimiter, strict=True))
        except csv.Error as error:
            raise TrackProblemsError([f"{path}:{number}: is not CSV: {error}"]) from None


def _places(path: Path, line: int, header: list[str], used: dict[str, tuple[str, float]]) -> dict[str, int]:
    """Return the index of the column of each quantity."""
    problems, places = [], {}
    for quantity, (name, _) in used.items():
        count = header.count(name)
        if count == 1:
            places[quantity] = header.index(name)
            continue
        if count:
            problems.append(f"{path}:{line}: column {name} stands {count} times in the header")
            continue
        close = get_close_matches(name, header, n=1)
        hint = f" (did you mean '{close[0]}'?)" if close else ""
        known = ", ".join(text[:40] for text in header[:30]) + (", ..." if len(header) > 30 else "")
        problems.append(f"{path}:{line}: there is no column {name} for {quantity}{hint}; the file has: {known}")
    if problems:
        raise TrackProblemsError(problems)
    return places


def _parse(
    path: Path,
    rows: Iterator[tuple[int, list[str]]],
    width: int,
    places: dict[str, int],
    *,
    used: dict[str, tuple[str, float]],
    settings: TrackPattern,
) -> _TrackTable:
    lines, columns = array("q"), {quantity: array("d") for quantity in used}
    problems: list[str] = []
    first = -math.inf if settings.from_s is None else settings.from_s
    last = math.inf if settings.to_s is None else settings.to_s
    for number, fields in rows:
        if len(fields) != width:
            problems.append(f"{path}:{number}: has {len(fields)} columns, the header has {width}")
        else:
            time = _number(fields[places["time"]])
            if time is None or first <= time * used["time"][1] <= last:
                problems += _append(path, number, fields, places, used=used, columns=columns)
                lines.append(number)
        if len(problems) >= MAX_PROBLEMS:
            problems[MAX_PROBLEMS - 1 :] = ["... and more problems"]
            break
        if len(lines) > MAX_ROWS:
            raise TrackProblemsError([f"{path}:{number}: has more than {MAX_ROWS} rows; allowed: a part of the log"])
    if problems:
        raise TrackProblemsError(problems)
    values = {quantity: np.array(column) * used[quantity][1] for quantity, column in columns.items()}
    return _TrackTable(values, {quantity: name for quantity, (name, _) in used.items()}, np.array(lines))


def _number(text: str) -> float | None:
    """Return a finite number, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in text else None


def _append(
    path: Path,
    number: int,
    fields: list[str],
    places: dict[str, int],
    *,
    used: dict[str, tuple[str, float]],
    columns: dict[str, array],
) -> Iterator[str]:
    """Add the numbers of one row; yield a problem for each field that is no number."""
    for quantity, place in places.items():
        value = _number(fields[place])
        columns[quantity].append(math.nan if value is None else value)
        if value is None:
            text = fields[place].strip()[:40]
            what = f"{text!a} is not a finite number" if text else "is empty"
            yield f"{path}:{number}: column {used[quantity][0]}: {what}"


def _cut(path: Path, table: _TrackTable, settings: TrackPattern) -> _TrackTable:
    """Return the rows between ``from_s`` and ``to_s``."""
    time = table.values["time"]
    rows = np.ones(len(time), dtype=bool)
    if settings.from_s is not None:
        rows &= ~(time < settings.from_s)
    if settings.to_s is not None:
        rows &= ~(time > settings.to_s)
    if rows.sum() < 4:
        found = f"{int(rows.sum())} rows"
        if len(time) and np.isfinite(time).all():
            found += f"; the file's times run from {time.min():g} to {time.max():g} s"
        raise TrackProblemsError([f"{path}: has {found}; allowed: at least 4 rows between from_s and to_s"])
    lines = None if table.lines is None else table.lines[rows]
    return _TrackTable({name: value[rows] for name, value in table.values.items()}, table.names, lines)


def _problems(path: Path, table: _TrackTable, settings: TrackPattern) -> Iterator[str]:
    """Yield the problems of the numbers: the first row of each kind."""
    values, names = table.values, table.names

    def first(quantity: str, wrong: np.ndarray, why: Reason) -> Iterator[str]:
        if wrong.any():
            row = int(wrong.argmax())
            yield f"{table.where(path, row)}: column {names[quantity]}: {why(row)}"

    for quantity, value in values.items():
        yield from first(quantity, ~np.isfinite(value), _shown(value, "{} is not a finite number"))
    if not all(np.isfinite(value).all() for value in values.values()):
        return
    limits = {"lat": (-89.0, 89.0), "lon": (-360.0, 360.0), "pitch": (-85.0, 85.0)}
    limits |= {"roll": (-180.0, 180.0), "heading": (-360.0, 720.0)}
    for quantity, (low, high) in limits.items():
        if quantity in values:
            angle = np.degrees(values[quantity])
            text = f"{{:g}} deg is outside of {low:g} to {high:g} deg; is the unit right?"
            wrong = (angle < low - 1e-9) | (angle > high + 1e-9)
            yield from first(quantity, wrong, _shown(angle, text))
    alt = values["alt"]
    text = "{:g} m is outside of -500 to 30000 m; is the unit right?"
    yield from first("alt", (alt < -500.0) | (alt > 30_000.0), _shown(alt, text))
    for quantity in COUNTED:
        if quantity in values:
            yield from first(quantity, *_uncounted(quantity, values[quantity]))
    yield from _time_problems(path, table, settings, first)


def _shown(values: np.ndarray, text: str) -> Reason:
    """Return the reason that shows the value of a row in a format text."""
    return lambda row: text.format(values[row])


def _uncounted(quantity: str, value: np.ndarray) -> tuple[np.ndarray, Reason]:
    low, high = (0, 1) if quantity == "turn" else (1, 1000 if quantity == "circuit" else 10_000)
    wrong = (value != np.round(value)) | (value < low) | (value > high)
    return wrong, lambda row: f"{value[row]:g} is no number of it; allowed: whole numbers from {low} to {high}"


def _time_problems(path: Path, table: _TrackTable, settings: TrackPattern, first: Finder) -> Iterator[str]:
    """Yield problems of order and gaps of the rows, then steps that no aircraft makes."""
    values, time = table.values, table.values["time"]
    step = np.diff(time, prepend=time[0] - 1e-3)
    backward = step <= 0.0
    yield from first("time", backward, lambda row: f"{time[row]:.6g} s is not after the row before")
    gap = step > settings.max_gap_s + 1e-9
    allowed = f"allowed: up to max_gap_s = {settings.max_gap_s:g}, or another from_s or to_s"
    yield from first("time", gap, lambda row: f"{step[row]:g} s are missing before {time[row]:.6g} s; {allowed}")
    if backward.any() or gap.any():
        return
    if time[-1] - time[0] < SHORTEST_S:
        yield f"{path}: is {time[-1] - time[0]:g} s long; allowed: at least {SHORTEST_S:g} s"
    scale = {"lat": 6.37e6, "lon": 6.37e6 * math.cos(float(values.get("lat", np.zeros(1))[0]))}
    for quantity in ("lat", "lon", "north", "east", "alt"):
        if quantity in values:
            along = np.unwrap(values[quantity]) if quantity == "lon" else values[quantity]
            speed = np.abs(np.diff(along, prepend=along[0])) * scale.get(quantity, 1.0) / step
            text = f"jumps at {{:.0f}} m/s, faster than {FASTEST_MPS:g}; is the unit right?"
            yield from first(quantity, speed > FASTEST_MPS, _shown(speed, text))
    for quantity in ("roll", "pitch", "heading"):
        angle = np.unwrap(values[quantity])
        rate = np.degrees(np.abs(np.diff(angle, prepend=angle[0]))) / step
        text = f"jumps at {{:.0f}} deg/s, faster than {FASTEST_TURN_DPS:g}; is the unit right?"
        yield from first(quantity, rate > FASTEST_TURN_DPS, _shown(rate, text))


def start_of(track: TrackLog | None, aircraft: Aircraft | None) -> dict[str, float]:
    """Return place, height, speed and heading of a track's first row for the table ``[start]``.

    Nothing of the motion depends on them. They are brought inside the limits of ``[start]``, which a log may pass.
    """
    speeds = (1.0, 300.0) if aircraft is None else aircraft.limits.speed_mps
    top = 10_000.0 if aircraft is None else aircraft.limits.alt_m
    if track is None:
        return {"lat_deg": 0.0, "lon_deg": 0.0, "alt_m": min(1000.0, top), "speed_mps": speeds[0], "heading_deg": 0.0}
    time, out = track["time"], {}
    step = time[1] - time[0]
    if "lat" in track:
        lat, lon = float(track["lat"][0]), float(track["lon"][0])
        out["lat_deg"], out["lon_deg"] = math.degrees(lat), math.degrees(math.remainder(lon, 2.0 * math.pi))
        meridian, normal = radii_of_curvature(lat)
        north = (track["lat"][1] - lat) * meridian
        east = (track["lon"][1] - lon) * normal * math.cos(lat)
    else:
        north, east = track["north"][1] - track["north"][0], track["east"][1] - track["east"][0]
    speed = math.hypot(float(north), float(east)) / float(step)
    return out | {
        "alt_m": min(max(float(track["alt"][0]), 1.0), top),
        "speed_mps": min(max(speed, speeds[0]), speeds[1]),
        "heading_deg": math.degrees(float(track["heading"][0])) % 360.0,
    }
