"""PickedLines of a text as they come: one line in, one line out, as many rows later as the method looks ahead."""

from collections import deque
from collections.abc import Callable, Iterable
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
from magsim.exchange.importing import converted
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
    stream : Stream
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
        stream: Stream,
        kind: str,
        mapping: ColumnMap,
        write: Callable[[bytes], object],
        *,
        lines: PickedLines | None = None,
    ) -> None:
        self._stream = stream
        self._kind, self._mapping, self._lines = kind, mapping, lines
        self._names = new_columns(stream.sensor)
        self._rows = row_parser(kind, STDIN)
        self._appender = Appender(kind, self._names)
        self._output = _Output(self._appender, write)
        self._picked: textfile.PickedColumns | None = None
        self._match: FieldMatch | None = None
        self._held: list[tuple[int, bytes]] = []
        """PickedLines before the first row of an XYZ text: which of them names the columns is not known yet."""
        self._place: tuple[float, ...] = ()
        self._last_s = -np.inf
        self._is_checked = False

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
            self._output.estimates(self._stream.finish())
        if self._picked is None:
            msg = f"{STDIN}: {self._rows.empty}"
            raise DataError(msg)
        return count

    def _take(self, number: int, line: bytes) -> bool:
        """Take a line; whether it is a row."""
        text = textfile.text_of(STDIN, number, line)
        row = self._rows.row(number, text)
        if self._rows.names and self._picked is None:
            self._begin()
        if row is None or self._picked is None:
            if self._picked is None:
                self._held.append((number, line))
            else:
                self._output.line(self._with_names(number, line))
            return False
        self._push(number, line, self._picked.values(number, row))
        return True

    def _begin(self) -> None:
        """Match the columns, now that their names are known, and give out what was held."""
        check_new(self._rows.names, self._names, STDIN)
        match = match_fields(self._rows.names, self._mapping, layout=self._kind, where=STDIN)
        needed = [name for name in self._stream.columns if name != columns.TIME]
        missing = [name for name in needed if name not in match.sources]
        if missing:
            has = ", ".join(list(match.sources)[:20]) or "no column of a recording"
            msg = f"{STDIN}: there is no {', '.join(missing)}, which the method needs; there is {has}; "
            msg += "--map names columns"
            raise RequestError(msg)
        if self._lines is not None and not match.line:
            msg = f"--lines {self._lines.text}: {STDIN} has no numbers of lines; the key line of a map names them"
            raise RequestError(msg)
        self._match = restricted(match, needed)
        self._picked = textfile.PickedColumns(STDIN, self._rows, self._match.wanted())
        for number, line in self._held:
            self._output.line(self._with_names(number, line))
        self._held.clear()

    def _with_names(self, number: int, line: bytes) -> bytes:
        """Return a line that is no row, with the new names where it names the columns."""
        named = is_head(self._rows, number, textfile.text_of(STDIN, number, line))
        return self._appender.head(line) if named else line

    def _push(self, number: int, line: bytes, numbers: list[float]) -> None:
        assert self._match is not None
        assert self._picked is not None
        fields = dict(zip(self._picked.names, numbers, strict=True))
        values = self._values(number, fields)
        if values is None:
            self._output.row(line, is_due=False)
            return
        self._check_time(number, fields, values[0])
        found = self._stream.push_values(values)
        self._output.row(line, is_due=True)
        self._output.estimates([] if found is None else [found])

    def _values(self, number: int, fields: dict[str, float]) -> np.ndarray | None:
        """Return what the stream takes; None for a row that is not asked for, or lacks a value."""
        assert self._match is not None
        if self._lines is not None and fields[self._match.line] not in self._lines:
            return None
        where = f"{STDIN}:{number}"
        data = {
            name: converted(where, name, source, np.array([fields[source.column]]))
            for name, source in self._match.sources.items()
        }
        values = np.array([fields[self._match.time], *(data[name][0] for name in self._stream.columns[1:])])
        if not np.isfinite(values).all():
            return None
        if not self._is_checked:
            problems = problems_of(data)
            if problems:
                raise DataError("\n".join(f"{where}: {problem}" for problem in problems))
            self._is_checked = True
        return values

    def _check_time(self, number: int, fields: dict[str, float], time_s: float) -> None:
        """Begin anew where another line or flight begins at an earlier time."""
        assert self._match is not None
        place = tuple(fields[name] for name in (self._match.flight, self._match.line) if name)
        if time_s <= self._last_s:
            if place == self._place:
                msg = (
                    f"{STDIN}:{number}: time does not increase strictly: {time_s:.10g} follows {self._last_s:.10g} on "
                    "the same line"
                )
                raise DataError(msg)
            self._output.estimates(self._stream.finish())
        self._place, self._last_s = place, time_s
