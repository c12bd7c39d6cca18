"""Export of tables for survey programs and data frames: Geosoft XYZ, ASEG-GDF2, CSV, Parquet.

The printed digits are the precision: a value read back differs by at most half of the last digit.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TextIO

import numpy as np

import magsim
from magsim import columns
from magsim.errors import DataError, RequestError
from magsim.exchange import sgl
from magsim.recording import Recording

DIGITS = {"nT": 4, "m": 4, "rad": 12, "1": 6}
"""Decimals by unit; 6 for all others."""

POSITION_DIGITS = 9
"""Of latitudes and longitudes in degrees: 0.1 mm."""

CHUNK = 2000
"""Rows that are formatted at once."""

MISSING = "*"
"""Text of a missing value in XYZ files."""


@dataclass(frozen=True)
class PrintedColumn:
    """One printed column; NaN in ``values`` is a missing value."""

    name: str
    unit: str
    meaning: str
    digits: int
    values: np.ndarray


def write_xyz(path: Path, recording: Recording, flight: int) -> None:
    """Write standard Geosoft XYZ: comments, ``//Flight``, ``//Date``, and a ``LINE`` record before each line's rows."""
    printed = columns_of(recording)
    lines = line_numbers(recording)
    starts = [0, *(np.flatnonzero(np.diff(lines)) + 1).tolist(), len(lines)]
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write(f"/ magsim {magsim.__version__}: flight {_plain(recording.name)}\n")
        file.write(f"/ missing values: {MISSING}\n")
        for column in printed:
            file.write(f"/ {column.name} [{column.unit}]: {column.meaning}\n")
        file.write(f"//Flight {flight}\n")
        if isinstance(recording.meta.get("start_utc"), str):
            file.write(f"//Date {sgl.start_of(recording):%Y/%m/%d}\n")
        file.write("/ " + " ".join(column.name for column in printed) + "\n")
        for first, last in pairwise(starts):
            file.write(f"LINE {int(lines[first])}\n")
            _write_rows(file, printed, first, last)


def write_sgl(path: Path, recording: Recording, flight: int) -> None:
    """Write XYZ as SGL does: column names in the third line, the number of the survey line in the first column."""
    fields = sgl.fields_of(recording, flight)
    printed = [
        PrintedColumn(sgl.BY_NAME[name].head, sgl.BY_NAME[name].unit, "", _sgl_digits(name), values)
        for name, values in fields.items()
    ]
    date = sgl.start_of(recording)
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write(f"/ magsim {magsim.__version__}: flight {_plain(recording.name)}, {date:%Y-%m-%d}\n")
        file.write(f"/ missing values: {MISSING}; layout of SGL 2020\n")
        file.write("/ " + " ".join(column.name for column in printed) + "\n")
        _write_rows(file, printed, 0, len(recording))


def _sgl_digits(name: str) -> int:
    special = {"line": 2, "flight": 0, "year": 0, "doy": 0, "lat": POSITION_DIGITS, "lon": POSITION_DIGITS}
    return special.get(name, DIGITS.get(sgl.BY_NAME[name].unit, 6))


def write_dat(path: Path, recording: Recording) -> None:
    """Write the records of an ASEG-GDF2 pair: columns of fixed width."""
    printed = gdf2_columns(recording)
    with path.open("w", encoding="ascii", newline="\n") as file:
        _write_rows(file, printed, 0, len(recording), widths=[_width(column) for column in printed])


def write_dfn(path: Path, recording: Recording) -> None:
    """Write the definitions of an ASEG-GDF2 pair (Pratt 2003, ASEG-GDF2 revision 4)."""
    printed = gdf2_columns(recording)
    with path.open("w", encoding="ascii", newline="\n") as file:
        for number, column in enumerate(printed, start=1):
            kind = f"I{_width(column)}" if column.digits == 0 else f"F{_width(column)}.{column.digits}"
            details = [] if column.unit == "1" else [f"UNIT={column.unit}"]
            if column.name == columns.RADAR.pattern:
                details.append(f"NULL={_form(column.digits) % -1.0}")
            details.append("NAME=" + re.sub(r"[,;:=\s]+", " ", column.meaning))
            file.write(f"DEFN {number} ST=RECD,RT=;{column.name}:{kind}:{','.join(details)}\n")
        file.write(f"DEFN {len(printed) + 1} ST=RECD,RT=;END DEFN\n")


def gdf2_columns(recording: Recording) -> list[PrintedColumn]:
    """Return the number of the line, then every column."""
    line = PrintedColumn("line", "1", "Number of the line", 0, line_numbers(recording))
    return [line, *columns_of(recording)]


def _width(column: PrintedColumn) -> int:
    """Return the width of a fixed column, with a blank before the longest number."""
    ends = (float(np.min(column.values)), float(np.max(column.values)))
    return 1 + max(len(_form(column.digits) % value) for value in (*ends, -1.0))


def write_csv(path: Path, recording: Recording) -> None:
    """Write every column, its unit in its name, with the shortest digits that are read as the same number."""
    recording.to_frame().to_csv(path, lineterminator="\n")


def write_parquet(path: Path, recording: Recording) -> None:
    """Write every column as float64, with unit, role and meaning as metadata of its field.

    Raises
    ------
    RequestError
        If pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        msg = 'the format parquet needs pyarrow: pip install "aeromagsim[parquet]"'
        raise RequestError(msg) from None
    fields = [pa.field(columns.TIME, pa.float64(), nullable=False, metadata={"unit": "s"})]
    for name in recording.data:
        family = columns.family_of(name)
        details = {"unit": family.unit, "role": family.role, "meaning": family.meaning}
        fields.append(pa.field(name, pa.float64(), nullable=False, metadata=details))
    about = {"magsim": magsim.__version__, "name": recording.name}
    start = recording.meta.get("start_utc")
    if isinstance(start, str):
        about["start_utc"] = start
    schema = pa.schema(fields, metadata=about)
    parquet.write_table(pa.table([recording.time_s, *recording.data.values()], schema=schema), path)


def columns_of(recording: Recording) -> list[PrintedColumn]:
    """Return time and every column, with the digits to print."""
    out = [PrintedColumn(columns.TIME, "s", "Time from the first recorded row", 6, recording.time_s)]
    for name, values in recording.data.items():
        family = columns.family_of(name)
        whole = family.unit == "1" and bool(np.all(values == np.rint(values)))
        position = name.endswith(("_lat_deg", "_lon_deg"))
        digits = 0 if whole else POSITION_DIGITS if position else DIGITS.get(family.unit, 6)
        out.append(PrintedColumn(name, family.unit, family.meaning, digits, values))
    return out


def line_numbers(recording: Recording) -> np.ndarray:
    """Return the number of the line of every row, (n,): circuit and leg, 101, 102, ... 201; 1 if neither is known."""
    circuit, leg = (recording.data.get(family.pattern) for family in (columns.CIRCUIT, columns.LEG))
    if circuit is None:
        return np.ones(len(recording)) if leg is None else np.rint(leg)
    if leg is None:
        return np.rint(circuit)
    step = max(100.0, 10.0 ** np.ceil(np.log10(np.max(leg) + 1.0)))
    return np.rint(circuit * step + leg)


def _form(digits: int) -> str:
    return f"%.{digits}f"


def _write_rows(
    file: TextIO, printed: Sequence[PrintedColumn], first: int, last: int, widths: Sequence[int] | None = None
) -> None:
    """Write rows of numbers, in chunks so that a long flight does not fill the memory."""
    for begin in range(first, last, CHUNK):
        end = min(last, begin + CHUNK)
        texts = [_texts(column, begin, end, 0 if widths is None else widths[i]) for i, column in enumerate(printed)]
        separator = " " if widths is None else ""
        file.writelines(separator.join(row) + "\n" for row in zip(*texts, strict=True))


def _texts(column: PrintedColumn, begin: int, end: int, width: int) -> Iterable[str]:
    form = f"%{width or ''}.{column.digits}f"
    values = column.values[begin:end].tolist()
    texts = [MISSING if value != value else form % value for value in values]  # noqa: PLR0124 - NaN alone differs
    if width and any(len(text) > width for text in texts):
        msg = f"column {column.name}: a number is wider than {width} places"
        raise DataError(msg)
    return texts


def _plain(text: str) -> str:
    return "".join(c if " " <= c <= "~" else "?" for c in text)
