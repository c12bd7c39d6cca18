"""The same file with what a compensation gave: all else stays as it is, to the byte where the file is text."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from magsim import columns, storage
from magsim.errors import DataError, RequestError
from magsim.exchange import textfile
from magsim.exchange.compensating.reading import RECORDING, SurveyFile
from magsim.exchange.tables import DIGITS, MISSING
from magsim.recording import Recording, write_recordings

WIDTH = 14
"""Places of a number that is appended to a line of an XYZ file."""


def new_columns(sensor: str) -> tuple[str, str]:
    """Return the names of the columns that are added: compensated reading, and what was removed."""
    return columns.COMPENSATED.name(sensor=sensor), columns.REMOVED.name(sensor=sensor)


class Appender:
    """Appends values to the lines of a text table.

    Parameters
    ----------
    kind : str
        Format of the text.
    names : sequence of str
        Of the new columns.
    """

    def __init__(self, kind: str, names: Iterable[str]) -> None:
        self._is_csv = kind == "csv"
        self._names = tuple(names)

    def head(self, line: bytes) -> bytes:
        """Return the line that names the columns, with the new ones."""
        return self._appended(line, ("," if self._is_csv else " ").join(self._names))

    def row(self, line: bytes, values: Iterable[float]) -> bytes:
        """Return a row with values; NaN is a missing one."""
        digits = DIGITS["nT"]
        texts = [f"{value:.{digits}f}" if np.isfinite(value) else "" for value in values]
        if self._is_csv:
            return self._appended(line, ",".join(texts))
        return self._appended(line, " ".join((text or MISSING).rjust(WIDTH) for text in texts))

    def _appended(self, line: bytes, text: str) -> bytes:
        body = line.rstrip(b"\r\n")
        return body + (b"," if self._is_csv else b" ") + text.encode() + line[len(body) :]


def row_parser(kind: str, where: str) -> textfile.CsvRows | textfile.XyzRows:
    """Return what finds the rows of a text."""
    return textfile.CsvRows(where) if kind == "csv" else textfile.XyzRows(where)


def is_head(rows: textfile.CsvRows | textfile.XyzRows, number: int, line: str) -> bool:
    """Return whether a line that is no row names the columns; in XYZ once they are known."""
    if isinstance(rows, textfile.CsvRows):
        return number == 1
    return line.lstrip().startswith("/") and bool(rows.head) and textfile.comment_words(line) == list(rows.head)


def check_new(taken: Iterable[str], names: Iterable[str], where: str) -> None:
    """Refuse a file that has the new columns already.

    Raises
    ------
    RequestError
    """
    there = [name for name in names if name in set(taken)]
    if there:
        msg = f"{where}: has {', '.join(there)} already; compensate the file without, or take another one"
        raise RequestError(msg)


def write_compensated(found: SurveyFile, values: list[np.ndarray], sensor: str, output: Path, *, force: bool) -> int:
    """Write the file with the new columns, whole or not at all.

    Parameters
    ----------
    found : SurveyFile
    values : list of (n, 2) [nT]
        For each of its surveys; NaN where there is nothing.
    sensor : str
    output : Path
    force : bool
        Replace a file that is there.

    Returns
    -------
    int
        Rows of a recording that are left out, since it holds no missing values.

    Raises
    ------
    RequestError
        If the new columns are there already, or the output cannot be written.
    DataError
        If nothing is left.
    """
    names = new_columns(sensor)
    if found.kind == RECORDING:
        return _write_recordings(found, values, names, output, force=force)
    if found.kind == "mit":
        storage.atomic_write(output, lambda path: _write_fields(found.path, values[0], names, path), force=force)
    else:
        storage.atomic_write(output, lambda path: _write_text(found, values[0], names, path), force=force)
    return 0


def _write_recordings(
    found: SurveyFile, values: list[np.ndarray], names: tuple[str, str], output: Path, *, force: bool
) -> int:
    kept: list[Recording] = []
    for recording, table in zip(found.recordings, values, strict=True):
        check_new(recording.data, names, str(found.path))
        rows = np.isfinite(table).all(axis=1)
        if rows.sum() < 2:
            continue
        data = {**recording.data, **dict(zip(names, table.T, strict=True))}
        order = [name for role in columns.ROLES for name in data if columns.role_of(name) == role]
        whole = replace(recording, data={name: data[name] for name in order})
        kept.append(whole if rows.all() else whole.take(rows))
    if not kept:
        msg = f"{found.path}: no rows are left that have an estimate"
        raise DataError(msg)
    write_recordings(output, kept, force=force)
    return sum(map(len, found.recordings)) - sum(map(len, kept))


def _write_fields(source: Path, values: np.ndarray, names: tuple[str, str], path: Path) -> None:
    """Copy a file in the layout of MagNav.jl and add fields; its reader takes NaN for missing values."""
    import shutil

    import h5py

    shutil.copyfile(source, path)
    with h5py.File(path, "r+") as file:
        check_new(file, names, str(source))
        for name, column in zip(names, values.T, strict=True):
            file.create_dataset(name, data=column)


def _write_text(found: SurveyFile, values: np.ndarray, names: tuple[str, str], path: Path) -> None:
    with path.open("wb") as file:
        copy_rows(found.kind, found.path, values, names, file)


def copy_rows(kind: str, source: Path, values: np.ndarray, names: tuple[str, str], file: BinaryIO) -> None:
    """Copy a text line by line, with values appended to its rows and names to the line that names its columns."""
    appender = Appender(kind, names)
    known = row_parser(kind, str(source))
    for number, line in textfile.lines_of(source):  # find the names, which stand before the first row
        known.row(number, textfile.text_of(str(source), number, line))
        if known.names:
            break
    check_new(known.names, names, str(source))
    rows = row_parser(kind, str(source))
    place = 0
    for number, line in textfile.lines_of(source):
        text = textfile.text_of(str(source), number, line)
        if rows.row(number, text) is not None:
            file.write(appender.row(line, values[place]))
            place += 1
        else:
            file.write(appender.head(line) if is_head(known, number, text) else line)
