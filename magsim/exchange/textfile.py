"""Strict reading of text tables from any source, with bounds on their size.

Every row has as many values as the head has names, every value is a plain decimal number within limits or marked as
missing, and the sizes of files, lines and tables are limited. Errors state the number of the line.
"""

import re
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NoReturn, Protocol

import numpy as np

from magsim.errors import DataError, RequestError

MAX_BYTES = 4 * 1024**3
MAX_LINE = 65_536
MAX_COLUMNS = 2_000
MAX_CELLS = 200_000_000
"""Most values of a table: 1.6 GB."""

LARGEST = 1e15
"""Largest magnitude of a number."""

MISSING = frozenset(("*", "", "nan", "NaN", "NAN"))
"""Texts that stand for a missing value."""

MAX_HEADS = 5_000
"""Comments before the first row that are searched for the names of columns."""

LINE_RECORDS = ("LINE", "TIE")
LINE_FIELD = "line_record"
"""Field with the numbers of the ``LINE`` records of standard Geosoft XYZ."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][+-]?[0-9]{1,4})?")

Choose = Callable[[Sequence[str]], Collection[str]]


def read_csv(path: Path, choose: Choose, nulls: Collection[float] = ()) -> dict[str, np.ndarray]:
    """Read columns of a table with commas and one line of names.

    Parameters
    ----------
    path : Path
    choose : callable
        Called with the names of all columns; returns those that are wanted.
    nulls : collection of float
        Numbers that stand for missing values.

    Returns
    -------
    dict of str to (n,)
        Missing values are NaN.

    Raises
    ------
    RequestError
        If there is no such file, or it is too large.
    DataError
        If its content is not such a table.
    """
    return read_table(path, CsvRows(str(path)), choose, nulls)


def read_xyz(path: Path, choose: Choose, nulls: Collection[float] = ()) -> dict[str, np.ndarray]:
    """Read columns of an XYZ file, as SGL or as Geosoft writes it.

    ``LINE`` and ``TIE`` records become the field ``line_record``. See ``read_csv`` for arguments and errors.
    """
    return read_table(path, XyzRows(str(path)), choose, nulls)


def read_table(path: Path, rows: "Rows", choose: Choose, nulls: Collection[float]) -> dict[str, np.ndarray]:
    """Read columns of a table whose lines are read one by one; see ``read_csv``."""
    picked: PickedColumns | None = None
    stored: list[array[float]] = []
    cells_left = MAX_CELLS
    for number, line in lines_of(path):
        row = rows.row(number, text_of(str(path), number, line))
        if rows.names and picked is None:
            picked = PickedColumns(str(path), rows, choose(rows.names), nulls)
            stored = [array("d") for _ in picked.names]
        if row is None or picked is None:
            continue
        cells_left -= len(stored)
        if cells_left < 0:
            _refuse(str(path), number, f"the table has more than {MAX_CELLS} values, which is too large")
        for column, value in zip(stored, picked.values(number, row), strict=True):
            column.append(value)
    if picked is None:
        msg = f"{path}: {rows.empty}"
        raise DataError(msg)
    return {name: np.array(column) for name, column in zip(picked.names, stored, strict=True)}


class Rows(Protocol):
    """Finds the rows of a table among the lines of a text.

    Attributes
    ----------
    names : sequence of str
        Of the columns; empty until they are known.
    empty : str
        What is wrong with a text in which they stay unknown.
    """

    names: Sequence[str]
    empty: str

    def row(self, number: int, line: str) -> Sequence[str] | None:
        """Return the texts of a row, or None for a line that is none.

        Parameters
        ----------
        number : int
            Of the line, from 1: lines must come in their order.
        line : str

        Raises
        ------
        DataError
            If the line fits no such table.
        """


class CsvRows:
    """Rows with commas after one line of names; see ``Rows``."""

    empty = "there is no line with the names of the columns"

    def __init__(self, where: str) -> None:
        self._where = where
        self.names: Sequence[str] = ()

    def row(self, number: int, line: str) -> Sequence[str] | None:
        """Return the texts of a row; see ``Rows``."""
        if not self.names:
            names = [name.strip().strip('"') for name in line.split(",")]
            self.names = _checked_names(self._where, number, names)
            return None
        return [value.strip() for value in line.split(",")] if line.strip() else None


class XyzRows:
    """Rows with blanks, comments and ``LINE`` records; see ``Rows``.

    The names are those of the last comment before the first row that has as many words as the row.

    Attributes
    ----------
    head : sequence of str
        The words of that comment.
    """

    empty = "has no row of numbers"

    def __init__(self, where: str) -> None:
        self._where = where
        self._heads: list[tuple[int, list[str]]] = []
        self._line_record = ""
        self.head: Sequence[str] = ()
        self.names: Sequence[str] = ()

    def row(self, number: int, line: str) -> Sequence[str] | None:
        """Return the texts of a row, with that of its ``LINE`` record; see ``Rows``."""
        words = line.split()
        if not words:
            return None
        if words[0].startswith("/"):
            if not self.names and not words[0].startswith("//"):
                self._heads = [*self._heads[1 - MAX_HEADS :], (number, comment_words(line))]
            return None
        if words[0].upper() in LINE_RECORDS:
            if len(words) != 2:
                found = f"{line.strip()[:40]!a} is no line record; expected {words[0]} and one number"
                _refuse(self._where, number, found)
            self._line_record = words[1]
            return None
        if not self.names:
            self._name(number, len(words))
        return [*words, self._line_record] if self._line_record else words

    def _name(self, number: int, count: int) -> None:
        fitting = [head for head in self._heads if len(head[1]) == count]
        if not fitting:
            _refuse(self._where, number, f"no comment before this row names its {count} columns")
        head_number, self.head = fitting[-1]
        names = [*self.head, *([LINE_FIELD] if self._line_record else [])]
        self.names = _checked_names(self._where, head_number, names)


def comment_words(line: str) -> list[str]:
    """Return the words of a comment of an XYZ file, which begins with a slash."""
    return line.strip()[1:].split()


def _checked_names(where: str, number: int, names: Sequence[str]) -> Sequence[str]:
    if not any(names):
        _refuse(where, number, CsvRows.empty)
    if len(names) > MAX_COLUMNS:
        _refuse(where, number, f"there are {len(names)} columns; allowed: up to {MAX_COLUMNS}")
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        _refuse(where, number, f"column {twice[0][:60]!a} exists twice")
    return names


class PickedColumns:
    """The numbers of the wanted columns of rows that are checked one by one.

    Attributes
    ----------
    names : tuple of str
        Of the wanted columns, in the order of the table.
    """

    def __init__(self, where: str, rows: Rows, wanted: Collection[str], nulls: Collection[float] = ()) -> None:
        self._where = where
        self._nulls = frozenset(nulls)
        self._count = len(rows.names)
        self._columns = [(i, name) for i, name in enumerate(rows.names) if name in wanted]
        self.names = tuple(name for _, name in self._columns)

    def values(self, number: int, row: Sequence[str]) -> list[float]:
        """Return the numbers of a row, NaN where they are missing.

        Raises
        ------
        DataError
            If there are fewer or more values than columns, or a wanted one is no number.
        """
        if len(row) != self._count:
            _refuse(self._where, number, f"there are {len(row)} values; expected {self._count}, one a column")
        return [self._number(number, name, row[i]) for i, name in self._columns]

    def _number(self, number: int, name: str, text: str) -> float:
        if _NUMBER.fullmatch(text):
            value = float(text)
            if value in self._nulls:
                return np.nan
            if not -LARGEST <= value <= LARGEST:
                _refuse(self._where, number, f"{name} is {text[:40]}; allowed: magnitudes up to {LARGEST:g}")
            return value
        if text not in MISSING:
            _refuse(self._where, number, f"{name} is {text[:40]!a}, which is not a number")
        return np.nan


def lines_of(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield the lines of a file with their numbers, from 1.

    Raises
    ------
    RequestError
        If there is no such file, or it is too large.
    DataError
        If a line is too long.
    """
    try:
        if path.exists() and not path.is_file():
            msg = f"{path}: is not a regular file"
            raise RequestError(msg)
        if path.stat().st_size > MAX_BYTES:
            msg = f"{path}: has {path.stat().st_size} bytes; allowed: up to {MAX_BYTES}"
            raise RequestError(msg)
        with path.open("rb") as file:
            yield from lines_from(str(path), file)
    except FileNotFoundError:
        msg = f"{path}: there is no such file"
        raise RequestError(msg) from None
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise RequestError(msg) from None


def lines_from(where: str, file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield the lines of an open file with their numbers, from 1, each as soon as it is there.

    Raises
    ------
    DataError
        If a line is too long.
    """
    number = 0
    while line := file.readline(MAX_LINE + 1):
        number += 1
        if len(line) > MAX_LINE:
            _refuse(where, number, f"the line is longer than {MAX_LINE} bytes")
        yield number, line


def text_of(where: str, number: int, line: bytes) -> str:
    """Return a line as text.

    Raises
    ------
    DataError
        If it is none.
    """
    try:
        text = line.decode("utf-8-sig" if number == 1 else "utf-8")
    except UnicodeDecodeError:
        _refuse(where, number, "is no text in UTF-8")
    if "\0" in text:
        _refuse(where, number, "holds a zero byte, so this is no text")
    return text


def _refuse(where: str, number: int, reason: str) -> NoReturn:
    msg = f"{where}:{number}: {reason}"
    raise DataError(msg)
