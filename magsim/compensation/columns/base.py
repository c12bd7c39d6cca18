"""Column sets: functions of a recording's inputs that a method weights or feeds to a network.

A column set is a small object that states what it reads. The scalar reading itself is in none of them: a method that
needs it must declare it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.recording import Recording


class Design(NamedTuple):
    """Columns side by side with their names and units."""

    names: tuple[str, ...]
    """(c,)"""
    units: tuple[str, ...]
    """(c,), of the coefficients"""
    matrix: np.ndarray
    """(n, c)"""
    groups: tuple[str, ...] = ()
    """(c,), what each coefficient belongs to (``Term.group``); empty where no report asks."""


class ColumnSet(Protocol):
    """Makes columns of a recording."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""

    @property
    def lookahead_rows(self) -> int | None:
        """Rows after its own that the columns of a row need, within a piece; None without limit."""

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording.

        Raises
        ------
        RequestError
            If the recording lacks what is read.
        DataError
            If a value is not finite.
        """


@dataclass(frozen=True)
class Joined:
    """Several column sets side by side.

    Attributes
    ----------
    sets : tuple of ColumnSet
    """

    sets: tuple[ColumnSet, ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""
        return tuple(dict.fromkeys(pattern for one in self.sets for pattern in one.reads))

    @property
    def lookahead_rows(self) -> int | None:
        """Rows after its own that the columns of a row need: the most of all sets."""
        found = [one.lookahead_rows for one in self.sets]
        known = [rows for rows in found if rows is not None]
        return max(known, default=0) if len(known) == len(found) else None

    def __call__(self, recording: Recording) -> Design:
        """Return all columns of a recording; see ``ColumnSet``."""
        parts = [one(recording) for one in self.sets]
        names = tuple(name for part in parts for name in part.names)
        units = tuple(unit for part in parts for unit in part.units)
        matrix = parts[0].matrix if len(parts) == 1 else np.hstack([part.matrix for part in parts])
        if not np.isfinite(matrix).all():
            row, column = np.argwhere(~np.isfinite(matrix))[0]
            msg = f"recording {recording.name!r}: {names[column]} is not finite at {recording.time_s[row]:g} s"
            raise DataError(msg)
        groups = tuple(group for part in parts for group in part.groups or ("",) * len(part.names))
        return Design(names, units, matrix, groups)


def require(recording: Recording, names: Sequence[str]) -> None:
    """Refuse a recording that lacks one of the named columns.

    Raises
    ------
    RequestError
        Naming all that are missing.
    """
    missing = [name for name in names if name not in recording]
    if missing:
        msg = f"recording {recording.name!r} has no column {', '.join(missing)}"
        raise RequestError(msg)
