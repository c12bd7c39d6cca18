"""The recursive method row by row: estimate first, then learn from the reading of the same row."""

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import numpy as np

from magsim.compensation.recursive.adaptation import Adaptation
from magsim.compensation.streaming import ColumnRows, Together
from magsim.compensation.streaming.protocol import RowWise

T = TypeVar("T")


class ReadingRows:
    """The reading of a scalar magnetometer [nT]; see ``magsim.compensation.streaming.RowWise``."""

    lookahead_rows = 0

    def __init__(self, name: str) -> None:
        self.columns = (name,)

    def push(self, values: np.ndarray) -> float:
        """Return the reading; see ``RowWise``."""
        return float(values[0])

    def finish(self) -> list[float]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []


class LearningStreamer(ABC, Generic[T]):
    """What is made of a row and its reading, which is learned from; see ``magsim.compensation.streaming.Streamer``.

    The estimate of a row is made before its own reading is learned from.

    Parameters
    ----------
    rows : RowWise
    reading : str
        Column of the reading.
    adaptation : Adaptation
    offset_nt : float [nT]
    """

    def __init__(self, rows: RowWise[T], reading: str, adaptation: Adaptation, offset_nt: float) -> None:
        self._together = Together([rows, ReadingRows(reading)])
        self._adaptation = adaptation
        self._offset_nt = offset_nt
        self.columns = self._together.columns
        self.lookahead_rows = self._together.lookahead_rows

    def push(self, values: np.ndarray) -> float | None:
        """Return the interference of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        found = self._together.push(values)
        return None if found is None else self._take(*found)

    def finish(self) -> list[float]:
        """Return the interference of the last rows [nT]; what was learned stays; see ``RowWise``."""
        left = [self._take(*found) for found in self._together.finish()]
        self._adaptation.end_piece()
        return left

    @abstractmethod
    def _take(self, row: T, reading_nt: float) -> float:
        """Return the interference of a row [nT], then learn from its reading."""


class RecursiveStreamer(LearningStreamer[np.ndarray]):
    """Columns, (c,), times coefficients that follow the flight.

    Attributes
    ----------
    coefficients : (c,)
        That the last estimate was made with.
    """

    def __init__(self, rows: ColumnRows, reading: str, adaptation: Adaptation, offset_nt: float) -> None:
        super().__init__(rows, reading, adaptation, offset_nt)
        self.coefficients = adaptation.coefficients

    def _take(self, row: np.ndarray, reading_nt: float) -> float:
        self.coefficients = self._adaptation.coefficients
        estimate = float(self.coefficients @ row) + self._offset_nt
        self._adaptation.learn(row, reading_nt)
        return estimate
