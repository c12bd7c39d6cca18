"""Strict reading of text tables from any source, with bounds on their size.

Every row has as many values as the head has names, every value is a plain decimal number within limits or marked as
missing, and the sizes of files, lines and tables are limited. Errors state the number of the line.
"""

import re
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

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


def read_csv(path: Path, choose: Choose) -> dict[str, np.ndarray]:
    """Read columns of a table with commas and one line of names.

    Parameters
    ----------
    path : Path
    choose : callable
        Called with the names of all columns; returns those that are wanted.

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
    lines = _lines(path)
    number, head = next(lines, (1, ""))
    names = [name.strip().strip('"') for name in head.split(",")]
    table = _TextTable(path, number, names, choose)
    for number, line in lines:
        if line.strip():
            table.add(number, [value.strip() for value in line.split(",")])
    return table.arrays()


def read_xyz(path: Path, choose: Choose) -> dict[str, np.ndarray]:
    """Read columns of an XYZ file, as SGL or as Geosoft writes it.

    The names are those of the last comment before the first row that has as many words as the row. ``LINE`` and
    ``TIE`` records become the field ``line_record``. See ``read_csv`` for arguments and errors.
    """
    heads: list[tuple[int, list[str]]] = []
    line_record = ""
    table: _TextTable | None = None
    for number, line in _lines(path):
        words = line.split()
        if not words:
            continue
        if words[0].startswith("/"):
            if table is None and not words[0].startswith("//"):
                heads = [*heads[1 - MAX_HEADS :], (number, line.strip()[1:].split())]
            continue
        if words[0].upper() in LINE_RECORDS:
            if len(words) != 2:
                _refuse(path, number, f"{line.strip()[:40]!a} is no line record; expected {words[0]} and one number")
            line_record = words[1]
            continue
        if table is None:
            fitting = [head for head in heads if len(head[1]) == len(words)]
            if not fitting:
                _refuse(path, number, f"no comment before this row names its {len(words)} columns")
            head_number, names = fitting[-1]
            table = _TextTable(path, head_number, [*names, *([LINE_FIELD] if line_record else [])], choose)
        table.add(number, [*words, line_record] if line_record else words)
    if table is None:
        msg = f"{path}: has no row of numbers"
        raise DataError(msg)
    return table.arrays()


class _TextTable:
    """The wanted columns of rows that are checked one by one."""

    def __init__(self, path: Path, number: int, names: Sequence[str], choose: Choose) -> None:
        self._path = path
        if not any(names):
            _refuse(path, number, "there is no line with the names of the columns")
        if len(names) > MAX_COLUMNS:
            _refuse(path, number, f"there are {len(names)} columns; allowed: up to {MAX_COLUMNS}")
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            _refuse(path, number, f"column {twice[0][:60]!a} exists twice")
        self._names = names
        wanted = choose(names)
        self._columns = [(i, name, array("d")) for i, name in enumerate(names) if name in wanted]
        self._cells_left = MAX_CELLS

    def add(self, number: int, values: Sequence[str]) -> None:
        """Check and append one row."""
        if len(values) != len(self._names):
            _refuse(self._path, number, f"there are {len(values)} values; expected {len(self._names)}, one a column")
        self._cells_left -= len(self._columns)
        if self._cells_left < 0:
            _refuse(self._path, number, f"the table has more than {MAX_CELLS} values, which is too large")
        for i, name, column in self._columns:
            text = values[i]
            if _NUMBER.fullmatch(text):
                value = float(text)
                if not -LARGEST <= value <= LARGEST:
                    _refuse(self._path, number, f"{name} is {text[:40]}; allowed: magnitudes up to {LARGEST:g}")
                column.append(value)
            elif text in MISSING:
                column.append(np.nan)
            else:
                _refuse(self._path, number, f"{name} is {text[:40]!a}, which is not a number")

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the columns, (n,) each."""
        return {name: np.array(column) for _, name, column in self._columns}


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines with their numbers, from 1."""
    try:
        if path.exists() and not path.is_file():
            msg = f"{path}: is not a regular file"
            raise RequestError(msg)
        if path.stat().st_size > MAX_BYTES:
            msg = f"{path}: has {path.stat().st_size} bytes; allowed: up to {MAX_BYTES}"
            raise RequestError(msg)
        with path.open("rb") as file:
            number = 0
            while line := file.readline(MAX_LINE + 1):
                number += 1
                if len(line) > MAX_LINE:
                    _refuse(path, number, f"the line is longer than {MAX_LINE} bytes")
                yield number, _text(path, number, line)
    except FileNotFoundError:
        msg = f"{path}: there is no such file"
        raise RequestError(msg) from None
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror}"
        raise RequestError(msg) from None


def _text(path: Path, number: int, line: bytes) -> str:
    try:
        text = line.decode("utf-8-sig" if number == 1 else "utf-8")
    except UnicodeDecodeError:
        _refuse(path, number, "is no text in UTF-8")
    if "\0" in text:
        _refuse(path, number, "holds a zero byte, so this is no text")
    return text


def _refuse(path: Path, number: int, reason: str) -> NoReturn:
    msg = f"{path}:{number}: {reason}"
    raise DataError(msg)
