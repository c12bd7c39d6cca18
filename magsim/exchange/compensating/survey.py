"""Rows of a survey file: with lines and flights, missing values, and what a method needs of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.compensation import Compensator
from magsim.errors import DataError, RequestError
from magsim.exchange.compensating.lines import PickedLines, shown
from magsim.exchange.importing import SHORTEST_S, TIME_DIGITS
from magsim.recording import Recording
from magsim.recording.channels import problems_of


class Piece(NamedTuple):
    """Rows of a survey file as a recording."""

    rows: np.ndarray
    """(m,), their places in the file."""
    recording: Recording


@dataclass(frozen=True)
class Survey:
    """Rows of a survey file.

    Attributes
    ----------
    where : str
        File, for messages.
    name : str
        Of the recordings that are made.
    time_s : (n,) [s]
        The file's own time.
    data : mapping of str to (n,)
        Columns of a recording; NaN where a value is missing.
    line, flight : (n,), optional
    start : callable
        Returns the instant of a row as text; None where it is not known.
    """

    where: str
    name: str
    time_s: np.ndarray
    data: Mapping[str, np.ndarray]
    line: np.ndarray | None
    flight: np.ndarray | None
    start: Callable[[int], str | None]

    def __len__(self) -> int:
        return len(self.time_s)

    def picked(self, lines: PickedLines | None, option: str) -> np.ndarray:
        """Return which rows are on lines, (n,) bool; all without lines.

        Raises
        ------
        RequestError
            If the file has no lines, or no such rows.
        """
        if lines is None:
            return np.ones(len(self), dtype=bool)
        if self.line is None:
            msg = f"{option} {lines.text}: {self.where} has no numbers of lines; the key line of a map names them"
            raise RequestError(msg)
        mask = lines.mask(self.line)
        if not mask.any():
            msg = f"{option} {lines.text}: {self.where} has no such line; it has {shown(self.line)}"
            raise RequestError(msg)
        return mask

    def pieces(self, mask: np.ndarray, needed: Sequence[str]) -> list[Piece]:
        """Return the rows of a mask in which all needed columns have values, as recordings.

        Time increases within each. Other columns are kept where they have values in all of its rows. A row that stands
        alone is left out.

        Raises
        ------
        DataError
            If the time does not increase within a line.
        """
        usable = mask & np.isfinite(self.time_s)
        for name in needed:
            usable &= np.isfinite(self.data[name])
        rows = np.flatnonzero(usable)
        back = np.diff(self.time_s[rows]) < SHORTEST_S
        self._check_order(rows, back)
        cuts = np.flatnonzero(back | self._other(self.flight, rows)) + 1
        return [Piece(part, self._recording(part)) for part in np.split(rows, cuts) if len(part) >= 2]

    def _check_order(self, rows: np.ndarray, back: np.ndarray) -> None:
        """Refuse time that does not increase but where another line or flight begins."""
        wrong = back & ~self._other(self.line, rows) & ~self._other(self.flight, rows)
        if wrong.any():
            row, before = rows[wrong.argmax() + 1], rows[wrong.argmax()]
            msg = (
                f"{self.where}: time does not increase strictly: {self.time_s[row]:.10g} in row {row + 1} follows "
                f"{self.time_s[before]:.10g} on the same line"
            )
            raise DataError(msg)

    @staticmethod
    def _other(numbers: np.ndarray | None, rows: np.ndarray) -> np.ndarray:
        """Return where the number differs from that of the row before, (m - 1,) bool."""
        return (
            np.zeros(len(rows) - 1 if len(rows) else 0, dtype=bool)
            if numbers is None
            else np.diff(numbers[rows]) != 0.0
        )

    def _recording(self, rows: np.ndarray) -> Recording:
        times = self.time_s[rows]
        data = {name: values[rows] for name, values in self.data.items()}
        data = {name: values for name, values in data.items() if np.isfinite(values).all()}
        start = self.start(int(rows[0]))
        meta = {} if start is None else {"start_utc": start}
        return Recording(self.name, np.round(times - times[0], TIME_DIGITS), data, meta)


def needed_columns(compensator: Compensator, survey: Survey) -> tuple[str, ...]:
    """Return the columns without which a row cannot be compensated.

    Raises
    ------
    RequestError
        If the file lacks one of them; all are named.
    """
    reading = columns.MAG.name(sensor=compensator.sensor_)
    names = [*compensator.input_columns(survey.data), reading]
    missing = [name for name in dict.fromkeys(names) if name not in survey.data]
    if missing:
        msg = (
            f"{survey.where}: there is no {', '.join(missing)}, which {compensator.name} for {compensator.sensor_} "
            f"needs; there is {', '.join(list(survey.data)[:20]) or 'no column of a recording'}; --map names columns"
        )
        raise RequestError(msg)
    return tuple(dict.fromkeys(names))


def check_channels(survey: Survey, pieces: Sequence[Piece], needed: Sequence[str]) -> None:
    """Refuse channels that are dead or in another unit.

    Raises
    ------
    DataError
    """
    rows = np.concatenate([piece.rows for piece in pieces])
    problems = problems_of({name: survey.data[name][rows] for name in needed})
    if problems:
        raise DataError("\n".join(f"{survey.where}: {problem}" for problem in problems))


def compensated(compensator: Compensator, survey: Survey, mask: np.ndarray) -> np.ndarray:
    """Compensate the rows of a mask.

    Returns
    -------
    (n, 2) [nT]
        Compensated reading and what was removed; NaN in all other rows, where a value is missing, and in warm-ups.

    Raises
    ------
    RequestError
        If a column is missing.
    DataError
        If there are too few rows, or a channel is dead or in another unit.
    """
    needed = needed_columns(compensator, survey)
    pieces = survey.pieces(mask, needed)
    if not pieces:
        msg = f"{survey.where}: has no two rows in a row with values of {', '.join(needed)}"
        raise DataError(msg)
    check_channels(survey, pieces, needed)
    out = np.full((len(survey), 2), np.nan)
    for rows, recording in pieces:
        removed = compensator.interference(recording)
        out[rows, 1] = removed
        out[rows, 0] = recording[columns.MAG.name(sensor=compensator.sensor_)] - removed
    return out
