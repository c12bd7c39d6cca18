"""Import of the files of other programs as recordings: inputs and segments, never truth."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NoReturn

import numpy as np

from magsim import columns
from magsim.config import load
from magsim.errors import DataError, RequestError
from magsim.exchange import mit, textfile
from magsim.exchange.columnmap import ColumnMap, FieldMatch, FieldSource, match_fields
from magsim.recording import Recording

SOURCES = ("mit", "sgl-xyz", "xyz", "csv")
"""Formats that can be read."""

ENDINGS = {".h5": "mit", ".hdf5": "mit", ".xyz": "sgl-xyz", ".csv": "csv"}

LIMITS = {
    "nT": 1e6,
    "deg": 360.0,
    "deg/s": 1e5,
    "m": 1e7,
    "m/s": 1e4,
    "m/s^2": 1e4,
    "Pa": 1e6,
    "A": 1e5,
    "V": 1e5,
    "1": 1e9,
}
"""Largest magnitude of a column by its unit: a larger value is in another unit."""

POSITION_LIMITS = {"ins_lat_deg": 90.0}

TIME_DIGITS = 9
"""Times are rounded to the nanosecond, so that steps of 0.1 s remain 0.1 s when a time of day is subtracted."""


SHORTEST_S = 1e-6
"""Shortest step of time; a shorter one counts as none."""

READERS = {
    "mit": mit.read,
    "sgl-xyz": textfile.read_xyz,
    "xyz": textfile.read_xyz,
    "csv": textfile.read_csv,
}
"""Readers by format: of a path and a function that chooses among the fields."""

CODES = {
    columns.SPLIT: columns.SPLITS,
    columns.MANEUVER: columns.MANEUVERS,
    columns.MAG_VALID: {0: "no reading", 1: "reading"},
}
"""Columns that hold a code, with the codes that are allowed."""


@dataclass(frozen=True)
class Imported:
    """A recording, and notes on how it was made.

    Attributes
    ----------
    recording : Recording
    notes : tuple of str
        One line each.
    """

    recording: Recording
    notes: tuple[str, ...]


def import_flight(
    path: Path,
    kind: str | None = None,
    *,
    column_map: Path | ColumnMap | None = None,
    flight: float | None = None,
    windows: Mapping[str, Sequence[str]] | None = None,
) -> Imported:
    """Make a recording from a file of another program.

    Parameters
    ----------
    path : Path
        The file.
    kind : str, optional
        One of ``SOURCES``; by default according to the ending of the file.
    column_map : Path or ColumnMap, optional
        TOML file that assigns fields to columns.
    flight : float, optional
        The flight of a file that holds several.
    windows : mapping, optional
        For ``train``, ``valid`` and ``test``: lines (``1002.02``), or spans of the file's own time
        (``46390.9:46964.5``, both ends included). Rows in none of them are left out, and the column ``split`` states
        the purpose of the others. Without windows all rows are imported, without that column.

    Returns
    -------
    Imported

    Raises
    ------
    RequestError
        If the flight, line or window that was asked for does not exist.
    DataError
        If the file is broken, or a value is not possible.
    """
    kind = kind_of(path, kind)
    mapping = load(column_map, ColumnMap) if isinstance(column_map, Path) else column_map or ColumnMap()
    matches: list[FieldMatch] = []

    def choose(available: Sequence[str]) -> dict[str, str]:
        matches.append(match_fields(available, mapping, layout=kind, where=str(path)))
        return matches[0].wanted()

    fields = READERS[kind](path, choose, mapping.nulls)
    match = matches[0]
    for name, values in fields.items():
        if np.isinf(values).any():
            _refuse(path, f"{name} is infinite in row {int(np.isinf(values).argmax()) + 1}")
    rows, number = _rows_of_flight(path, fields, match, flight)
    fields = {name: values[rows] for name, values in fields.items()}
    _check_time(path, fields[match.time], match.time)
    keep, split = _windows(path, fields, match, windows or {})
    fields = {name: values[keep] for name, values in fields.items()}

    time_s = fields[match.time]
    data, notes = _columns(path, fields, match)
    if match.line and columns.CIRCUIT.pattern not in data and np.isfinite(fields[match.line]).all():
        data[columns.CIRCUIT.pattern] = _ordinal(fields[match.line])
    if split is not None:
        data[columns.SPLIT.pattern] = split
    order = [name for role in columns.ROLES for name in data if columns.role_of(name) == role]
    meta: dict[str, object] = {"imported": kind}
    start = start_of(str(path), {name: float(values[0]) for name, values in fields.items()}, match, mapping)
    if start is not None:
        meta["start_utc"] = start.isoformat()
    name = mapping.name or (path.stem if number is None else f"flight_{number:g}")
    recording = Recording(
        re.sub(r"[^ -~]", "_", name)[:100],
        np.round(time_s - time_s[0], TIME_DIGITS),
        {name: data[name] for name in order},
        meta,
    )
    meta["rate_hz"] = round(recording.rate_hz, 9)
    return Imported(Recording(recording.name, recording.time_s, recording.data, meta), tuple(notes))


def _refuse(path: Path, reason: str) -> NoReturn:
    msg = f"{path}: {reason}"
    raise DataError(msg)


def kind_of(path: Path, kind: str | None) -> str:
    """Return the format of a file: the one that is asked for, or that of its ending.

    Raises
    ------
    RequestError
        If there is none.
    """
    found = kind or ENDINGS.get(path.suffix.lower())
    if found not in SOURCES:
        msg = f"{path}: its ending is not that of a format; give it with --format, allowed: {', '.join(SOURCES)}"
        raise RequestError(msg)
    return found


def _rows_of_flight(
    path: Path, fields: Mapping[str, np.ndarray], match: FieldMatch, flight: float | None
) -> tuple[np.ndarray | slice, float | None]:
    """Return the rows of the flight that is asked for, or of the only one, and its number."""
    if not match.flight:
        if flight is not None:
            msg = f"{path}: has no numbers of flights, so --flight cannot pick one"
            raise RequestError(msg)
        return slice(None), None
    values = fields[match.flight]
    numbers = np.unique(values[np.isfinite(values)])
    known = ", ".join(f"{value:g}" for value in numbers[:20]) or "none"
    if flight is None and len(numbers) > 1:
        msg = f"{path}: holds the flights {known}; pick one with --flight"
        raise RequestError(msg)
    if flight is None and np.isnan(values).any():
        return slice(None), None
    number = float(numbers[0]) if flight is None else flight
    if number not in numbers:
        msg = f"{path}: there is no flight {number:g}; allowed: {known}"
        raise RequestError(msg)
    return values == number, number


def _check_time(path: Path, time_s: np.ndarray, name: str) -> None:
    if len(time_s) < 2:
        _refuse(path, f"has {len(time_s)} rows; a recording has 2 at least")
    if np.isnan(time_s).any():
        _refuse(path, f"{name} is missing in row {int(np.isnan(time_s).argmax()) + 1}; every row needs its time")
    back = np.diff(time_s) < SHORTEST_S
    if back.any():
        row = int(back.argmax()) + 1
        _refuse(
            path,
            f"{name} does not increase strictly: {time_s[row]:.10g} in row {row + 1} follows {time_s[row - 1]:.10g}",
        )


def _windows(
    path: Path, fields: Mapping[str, np.ndarray], match: FieldMatch, windows: Mapping[str, Sequence[str]]
) -> tuple[np.ndarray | slice, np.ndarray | None]:
    """Return the rows that are in a window, and the split of each."""
    codes = {word: code for code, word in columns.SPLITS.items()}
    time_s = fields[match.time]
    split = np.full(len(time_s), -1.0)
    asked = [(word, text) for word, texts in windows.items() for text in texts]
    if not asked:
        return slice(None), None
    for word, text in asked:
        mask = _window(path, fields, match, word, text)
        if (split[mask] >= 0.0).any():
            msg = f"--{word} {text}: some of its rows are in another window already"
            raise RequestError(msg)
        split[mask] = codes[word]
    keep = split >= 0.0
    return keep, split[keep]


def _window(path: Path, fields: Mapping[str, np.ndarray], match: FieldMatch, word: str, text: str) -> np.ndarray:
    parts = text.split(":")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2) or not np.isfinite(numbers).all():
        msg = f"--{word} {text}: is no window; allowed: the number of a line, or START:END in the file's own time"
        raise RequestError(msg)
    time_s = fields[match.time]
    if len(numbers) == 2:
        mask = (time_s >= numbers[0] - 1e-6) & (time_s <= numbers[1] + 1e-6)
        extent = f"times from {time_s[0]:.10g} to {time_s[-1]:.10g}"
    else:
        if not match.line:
            msg = f"--{word} {text}: {path} has no line numbers; give START:END in its own time"
            raise RequestError(msg)
        # 1002.10 and 1002.1 are one number: lines differ by hundredths
        keys = np.round(fields[match.line] * 100.0)
        mask = keys == round(numbers[0] * 100.0)
        known = np.unique(keys[np.isfinite(keys)]) / 100.0
        extent = "lines " + ", ".join(f"{value:.2f}" for value in known[:20])
    if mask.sum() < 2:
        msg = f"--{word} {text}: {path} has {mask.sum()} such rows; it has {extent}"
        raise RequestError(msg)
    return mask


def _columns(
    path: Path, fields: Mapping[str, np.ndarray], match: FieldMatch
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the columns without a missing value, and notes about the others."""
    data: dict[str, np.ndarray] = {}
    notes = [f"left out, being no input or segment of a recording: {', '.join(match.unused)}"] if match.unused else []
    for name, source in match.sources.items():
        values = converted(str(path), name, source, fields[source.column])
        missing = np.isnan(values)
        if missing.any():
            notes.append(f"{source.column} is missing in {missing.sum()} of {len(values)} rows: no column {name}")
            continue
        data[name] = values
    if not columns.sensors_of(data, columns.MAG):
        details = f" ({'; '.join(notes)})" if notes else ""
        _refuse(path, f"there is no reading of a scalar magnetometer, mag_..._nt{details}; --map can name it")
    return data, notes


def converted(where: str, name: str, source: FieldSource, field: np.ndarray) -> np.ndarray:
    """Return the values of a column from those of a field, (n,); NaN where they are missing.

    Raises
    ------
    DataError
        If a value is not possible in the unit of the column.
    """
    values = field * source.scale + source.offset
    if name == columns.RADAR.pattern:
        values = np.where(np.isnan(values), -1.0, values)
    if name == "ins_heading_deg":
        values = values % 360.0
    family = columns.family_of(name)
    limit = POSITION_LIMITS.get(name, LIMITS.get(family.unit, textfile.LARGEST))
    beyond = np.abs(values) > limit
    if beyond.any():
        row = int(beyond.argmax())
        msg = f"{where}: {source.column} gives {name} = {values[row]:g} in row {row + 1}; allowed: up to {limit:g}"
        raise DataError(msg)
    codes = CODES.get(family)
    wrong = np.zeros(0) if codes is None else values[~np.isnan(values) & ~np.isin(values, list(codes))]
    if codes is not None and len(wrong):
        allowed = ", ".join(f"{code} {word}" for code, word in codes.items())
        msg = f"{where}: {source.column} gives {name} = {wrong[0]:g}; allowed: {allowed}"
        raise DataError(msg)
    return values


def _ordinal(values: np.ndarray) -> np.ndarray:
    """Return the rank of each value, from 1, in the order in which values first appear."""
    known, first, inverse = np.unique(values, return_index=True, return_inverse=True)
    rank = np.empty(len(known))
    rank[np.argsort(first)] = np.arange(1, len(known) + 1)
    return rank[inverse]


def start_of(where: str, row: Mapping[str, float], match: FieldMatch, mapping: ColumnMap) -> datetime | None:
    """Return the instant of a row; None where it is not known.

    The map's ``start_utc`` is the instant of time 0 of the file; years and days count from midnight.

    Raises
    ------
    DataError
        If its date is none.
    """
    time_s = row[match.time]
    zero = mapping.start_utc
    if zero is not None:
        zero = zero.replace(tzinfo=UTC) if zero.tzinfo is None else zero.astimezone(UTC)
    elif match.year and match.doy:
        year, doy = row[match.year], row[match.doy]
        if not (1900 <= year <= 2100 and 1 <= doy <= 366 and year % 1 == 0.0 and doy % 1 == 0.0):
            msg = f"{where}: year {year:g} and day {doy:g} in its first row are no date"
            raise DataError(msg)
        zero = datetime(int(year), 1, 1, tzinfo=UTC) + timedelta(days=doy - 1.0)
    if zero is None:
        return None
    try:
        return zero + timedelta(seconds=time_s)
    except OverflowError:
        msg = f"{where}: time {time_s:g} s in its first row is no time of a date"
        raise DataError(msg) from None
