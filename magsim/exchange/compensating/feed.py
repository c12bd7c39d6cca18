"""PickedLines of a text as they come: one line in, one line out, as many rows later as the method looks ahead."""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from magsim import columns
from magsim.compensation.streaming import Estimate, Stream
from magsim.errors import DataError, RequestError
from magsim.exchange import textfile
from magsim.exchange.columnmap import ColumnMap, FieldMatch, match_fields
from magsim.exchange.compensating.lines import PickedLines
from magsim.exchange.compensating.reading import restricted
from magsim.exchange.compensating.writing import Appender, check_new, is_head, new_columns, row_parser
from magsim.exchange.importing import converted, start_of
from magsim.exchange.textfile import CsvRows, PickedColumns, XyzRows
from magsim.recording.channels import problems_of

STDIN = "standard input"
"""Name of the feed in messages."""

_NOTHING = (np.nan, np.nan)


@dataclass
class _Waiting:
    """A line that is not written yet."""

    line: bytes
    is_ready: bool


class _Output:
    """PickedLines in their order: behind a row that waits for its estimate, all wait.

    Parameters
    ----------
    appender : Appender
    write : callable
        Takes each line.
    """

    def __init__(self, appender: Appender, write: Callable[[bytes], object]) -> None:
        self._appender, self._write = appender, write
        self._lines: deque[_Waiting] = deque()
        self._due: deque[_Waiting] = deque()

    def line(self, line: bytes) -> None:
        """Take a line that stays as it is."""
        self._lines.append(_Waiting(line, is_ready=True))
        self._flush()

    def row(self, line: bytes, *, is_due: bool) -> None:
        """Take a row: one whose estimate is due, or one that gets none."""
        waiting = _Waiting(line if is_due else self._appender.row(line, _NOTHING), is_ready=not is_due)
        self._lines.append(waiting)
        if is_due:
            self._due.append(waiting)
        self._flush()

    def estimates(self, found: Iterable[Estimate]) -> None:
        """Give estimates to the rows that wait for them."""
        for estimate in found:
            row = self._due.popleft()
            row.line = self._appender.row(row.line, (estimate.compensated_nt, estimate.interference_nt))
            row.is_ready = True
        self._flush()

    def _flush(self) -> None:
        while self._lines and self._lines[0].is_ready:
            self._write(self._lines.popleft().line)


class LineFeed:
    """Compensates a text line by line.

    Parameters
    ----------
    make : callable
        Makes the stream, given the instant of time 0 as text, or None where text and map do not tell it.
    kind : str
        Format of the text.
    mapping : ColumnMap
    write : callable
        Takes each line of the answer.
    lines : PickedLines, optional
        Rows on other lines get no values.
    """

    def __init__(
        self,
        make: Callable[[str | None], Stream],
        kind: str,
        mapping: ColumnMap,
        write: Callable[[bytes], object],
        *,
        lines: PickedLines | None = None,
    ) -> None:
        self._make, self._kind, self._mapping = make, kind, mapping
        self._write, self._lines = write, lines
        self._rows = row_parser(kind, STDIN)
        self._held: list[tuple[int, bytes]] = []
        """Lines before the first row: in XYZ it tells which of them names the columns."""
        self._table: _Table | None = None

    def run(self, source: BinaryIO) -> int:
        """Take all lines until the end.

        Returns
        -------
        int
            Rows.

        Raises
        ------
        RequestError
            If a column is missing.
        DataError
            If a line is broken, or there is no row at all. What was right before it has been written.
        """
        count = 0
        try:
            for number, line in textfile.lines_from(STDIN, source):
                count += self._take(number, line)
        finally:
            if self._table is not None:
                self._table.finish()
        if self._table is None:
            msg = f"{STDIN}: {'has no row of numbers' if self._rows.names else self._rows.empty}"
            raise DataError(msg)
        return count

    def _take(self, number: int, line: bytes) -> bool:
        """Take a line; whether it is a row."""
        row = self._rows.row(number, textfile.text_of(STDIN, number, line))
        if row is None:
            if self._table is None:
                self._held.append((number, line))
            else:
                self._table.other(number, line)
            return False
        if self._table is None:
            self._table = self._begin(number, row)
            for place, held in self._held:
                self._table.other(place, held)
            self._held.clear()
        self._table.row(number, line, row)
        return True

    def _begin(self, number: int, row: Sequence[str]) -> "_Table":
        """Make the stream and match its columns, now that names and date are known."""
        match = match_fields(self._rows.names, self._mapping, layout=self._kind, where=STDIN)
        if self._lines is not None and not match.line:
            msg = f"--lines {self._lines.text}: {STDIN} has no numbers of lines; the key line of a map names them"
            raise RequestError(msg)
        dated = [name for name in (match.year, match.doy) if name]
        found = PickedColumns(STDIN, self._rows, dated, self._mapping.nulls)
        date = dict(zip(found.names, found.values(number, row), strict=True))
        start = start_of(STDIN, {match.time: 0.0, **date}, match, self._mapping)
        stream = self._make(None if start is None else start.isoformat())
        needed = [name for name in stream.columns if name != columns.TIME]
        missing = [name for name in needed if name not in match.sources]
        if missing:
            has = ", ".join(list(match.sources)[:20]) or "no column of a recording"
            msg = f"{STDIN}: there is no {', '.join(missing)}, which the method needs; there is {has}; "
            msg += "--map names columns"
            raise RequestError(msg)
        names = new_columns(stream.sensor)
        check_new(self._rows.names, names, STDIN)
        kept = restricted(match, needed)
        picked = PickedColumns(STDIN, self._rows, kept.wanted(), self._mapping.nulls)
        appender = Appender(self._kind, names)
        return _Table(stream, self._rows, kept, picked, appender, _Output(appender, self._write), self._lines)


@dataclass
class _Table:
    """The rows of a text whose columns are known."""

    stream: Stream
    rows: CsvRows | XyzRows
    match: FieldMatch
    picked: PickedColumns
    appender: Appender
    output: _Output
    lines: PickedLines | None
    place: tuple[float, ...] = ()
    last_s: float = -np.inf
    is_checked: bool = False

    def finish(self) -> None:
        """Write what is still due."""
        self.output.estimates(self.stream.finish())

    def other(self, number: int, line: bytes) -> None:
        """Take a line that is no row; one that names the columns gets the new names."""
        named = is_head(self.rows, number, textfile.text_of(STDIN, number, line))
        self.output.line(self.appender.head(line) if named else line)

    def row(self, number: int, line: bytes, texts: Sequence[str]) -> None:
        """Take a row."""
        fields = dict(zip(self.picked.names, self.picked.values(number, texts), strict=True))
        values = self._values(number, fields)
        if values is None:
            self.output.row(line, is_due=False)
            return
        self._check_time(number, fields, values[0])
        found = self.stream.push_values(values)
        self.output.row(line, is_due=True)
        self.output.estimates([] if found is None else [found])

    def _values(self, number: int, fields: dict[str, float]) -> np.ndarray | None:
        """Return what the stream takes; None for a row that is not asked for, or lacks a value."""
        if self.lines is not None and fields[self.match.line] not in self.lines:
            return None
        where = f"{STDIN}:{number}"
        data = {
            name: converted(where, name, source, np.array([fields[source.column]]))
            for name, source in self.match.sources.items()
        }
        values = np.array([fields[self.match.time], *(data[name][0] for name in self.stream.columns[1:])])
        if not np.isfinite(values).all():
            return None
        if not self.is_checked:
            problems = problems_of(data)
            if problems:
                raise DataError("\n".join(f"{where}: {problem}" for problem in problems))
            self.is_checked = True
        return values

    def _check_time(self, number: int, fields: dict[str, float], time_s: float) -> None:
        """Begin anew where another line or flight begins at an earlier time."""
        place = tuple(fields[name] for name in (self.match.flight, self.match.line) if name)
        if time_s <= self.last_s:
            if place == self.place:
                msg = (
                    f"{STDIN}:{number}: time does not increase strictly: {time_s:.10g} follows {self.last_s:.10g} on "
                    "the same line"
                )
                raise DataError(msg)
            self.finish()
        self.place, self.last_s = place, time_s
