"""Columns that follow from the values of a row, or from these and their derivative by time."""

from abc import ABC, abstractmethod

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design, require
from magsim.compensation.columns.direction import time_derivative
from magsim.recording import Recording

TURN_DEG = 360.0


class PointColumns(ABC):
    """Columns of a row that follow from values of the same row alone; a ``ColumnSet``.

    Attributes
    ----------
    columns : tuple of str
        What is read.
    names, units : tuple of str
        Of what is made.
    """

    lookahead_rows = 0
    columns: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """Families of what is read."""
        return _families(self.columns)

    @abstractmethod
    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the columns, (n, k), for values of what is read, (n, c)."""

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        require(recording, self.columns)
        return Design(self.names, self.units, self.of(recording.stack(self.columns)))


class ChangeColumns(ABC):
    """Columns of a row that follow from angles and from their central differences; a ``ColumnSet``.

    Attributes
    ----------
    columns : tuple of str
        What is read, all of it in degrees; a difference is the short way round.
    names, units : tuple of str
        Of what is made.
    """

    lookahead_rows = 1
    columns: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """Families of what is read."""
        return _families(self.columns)

    @abstractmethod
    def of(self, values: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the columns, (n, k), for angles [deg] and their derivatives by time [deg/s], (n, c) each."""

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        require(recording, self.columns)
        values = recording.stack(self.columns)
        changes = time_derivative(np.unwrap(values, axis=0, period=TURN_DEG), recording.time_s)
        return Design(self.names, self.units, self.of(values, changes))


def short_way(difference_deg: np.ndarray) -> np.ndarray:
    """Return differences of angles the short way round, in [-180, 180) degrees."""
    return (difference_deg + TURN_DEG / 2.0) % TURN_DEG - TURN_DEG / 2.0


def _families(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(columns.family_of(name).pattern for name in names))
