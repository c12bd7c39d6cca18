"""Column sets row by row: the same values as ``magsim.compensation.columns`` gives for a whole recording."""

import math
from collections.abc import Sequence

import numpy as np

from magsim import columns
from magsim.compensation.columns import ChangeColumns, PointColumns
from magsim.compensation.columns.place import hour_of
from magsim.compensation.columns.points import short_way
from magsim.compensation.columns.tolles_lawson import TERMS
from magsim.compensation.streaming.protocol import Feed, RowWise
from magsim.compensation.streaming.together import Together
from magsim.errors import DataError, RequestError

ColumnRows = RowWise[np.ndarray]
"""Gives the columns of one row, (c,)."""

Vector = tuple[float, float, float]


class FluxgateRows:
    """The reading of a fluxgate, (x, y, z) [nT]."""

    lookahead_rows = 0

    def __init__(self, fluxgate: str) -> None:
        self.columns = tuple(columns.FLUX.name(sensor=fluxgate, axis=axis) for axis in columns.AXES)
        self._fluxgate = fluxgate

    def push(self, values: np.ndarray) -> Vector:
        """Return the reading; see ``RowWise``.

        Raises
        ------
        DataError
            If it is zero.
        """
        x, y, z = values.tolist()
        if x == y == z == 0.0:
            msg = f"fluxgate {self._fluxgate!r} has no direction: its three axes are 0"
            raise DataError(msg)
        return x, y, z

    def finish(self) -> list[Vector]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []


class TollesLawsonRows:
    """Tolles-Lawson columns of a vector that is given row by row, with central differences; see ``ColumnRows``.

    Parameters
    ----------
    vectors : RowWise of (x, y, z) [nT]
    terms : {3, 8, 9, 16, 18}
    strength_nt : float [nT], optional
        Field strength in the columns; the length of the vector, row by row, if not given.
    rate_hz : float [Hz]
    by_field : bool
        Eddy columns of the derivative of the vector, not of its direction.
    """

    def __init__(
        self, vectors: RowWise[Vector], terms: int, strength_nt: float | None, rate_hz: float, by_field: bool = False
    ) -> None:
        self._vectors = vectors
        self._induced, self._eddy = TERMS[terms]
        self._strength_nt = strength_nt
        traceless = strength_nt is None and (1, 1) in self._induced
        self._trace = [1.0 / 3.0 if traceless and i == j else 0.0 for i, j in self._induced]
        self._rate_hz = rate_hz
        self._by_field = by_field
        self.columns = vectors.columns
        self.lookahead_rows = vectors.lookahead_rows + (1 if self._eddy else 0)
        self._before: Vector | None = None
        self._here: tuple[Vector, float, Vector] | None = None

    def push(self, values: np.ndarray) -> np.ndarray | None:
        """Return the columns of the row ``lookahead_rows`` before, (terms,); see ``RowWise``."""
        vector = self._vectors.push(values)
        return None if vector is None else self._next(vector)

    def finish(self) -> list[np.ndarray]:
        """Return the columns of the last rows; see ``RowWise``."""
        found = [self._next(vector) for vector in self._vectors.finish()]
        if self._here is not None:
            found.append(self._columns(None))
        self._before = self._here = None
        return [row for row in found if row is not None]

    def _next(self, vector: Vector) -> np.ndarray | None:
        x, y, z = vector
        length = math.sqrt(x * x + y * y + z * z)
        unit = (x / length, y / length, z / length)
        if not self._eddy:
            return self._row(unit, length, unit)
        moving = vector if self._by_field else unit
        row = None if self._here is None else self._columns(moving)
        self._before = None if self._here is None else self._here[2]
        self._here = unit, length, moving
        return row

    def _columns(self, after: Vector | None) -> np.ndarray:
        """Return the columns of the row in the middle; one-sided differences at the ends of a piece, 0 for one row."""
        assert self._here is not None
        unit, length, here = self._here
        low, high = self._before or here, after or here
        sides = (self._before is not None) + (after is not None)
        per_s = self._rate_hz / sides if sides else 0.0
        rate = ((high[0] - low[0]) * per_s, (high[1] - low[1]) * per_s, (high[2] - low[2]) * per_s)
        return self._row(unit, length, rate)

    def _row(self, unit: Vector, length: float, rate: Vector) -> np.ndarray:
        strength = length if self._strength_nt is None else self._strength_nt
        field = (strength * unit[0], strength * unit[1], strength * unit[2])
        induced = [
            field[i] * unit[j] - third * length for (i, j), third in zip(self._induced, self._trace, strict=True)
        ]
        along = unit if self._by_field else field
        return np.array([*unit, *induced, *(along[i] * rate[j] for i, j in self._eddy)])


class PointRows:
    """Columns that follow from the values of a row, row by row; see ``PointColumns`` and ``ColumnRows``."""

    lookahead_rows = 0

    def __init__(self, made: PointColumns) -> None:
        self.columns = made.columns
        self._made = made

    def push(self, values: np.ndarray) -> np.ndarray:
        """Return the columns of the row; see ``RowWise``."""
        return self._made.of(values[None])[0]

    def finish(self) -> list[np.ndarray]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []


class ChangeRows:
    """Columns that follow from angles and their central differences, row by row; see ``ChangeColumns``."""

    lookahead_rows = 1

    def __init__(self, made: ChangeColumns, rate_hz: float) -> None:
        self.columns = made.columns
        self._made, self._rate_hz = made, rate_hz
        self._before: np.ndarray | None = None
        self._here: np.ndarray | None = None

    def push(self, values: np.ndarray) -> np.ndarray | None:
        """Return the columns of the row before; see ``RowWise``."""
        values = values.copy()
        row = None if self._here is None else self._row(self._here, values)
        self._before, self._here = self._here, values
        return row

    def finish(self) -> list[np.ndarray]:
        """Return the columns of the last row; see ``RowWise``."""
        left = [] if self._here is None else [self._row(self._here, None)]
        self._before = self._here = None
        return left

    def _row(self, here: np.ndarray, after: np.ndarray | None) -> np.ndarray:
        """Return the columns of a row; one-sided differences at the ends of a piece, 0 for one row."""
        steps = [short_way(after - here)] if after is not None else []
        steps += [short_way(here - self._before)] if self._before is not None else []
        change = self._rate_hz * np.mean(steps, axis=0) if steps else np.zeros_like(here)
        return self._made.of(here[None], change[None])[0]


class TimeRows:
    """Time of day, row by row; see ``TimeColumns``.

    Raises
    ------
    RequestError
        If the feed has no date.
    """

    lookahead_rows = 0
    columns = (columns.TIME,)

    def __init__(self, feed: Feed) -> None:
        if feed.start_utc is None:
            msg = "the time of day needs the date: give the stream start_utc, the instant of time 0"
            raise RequestError(msg)
        self._hour = hour_of(feed.start_utc)

    def push(self, values: np.ndarray) -> np.ndarray:
        """Return the hour; see ``RowWise``."""
        return self._hour + values / 3600.0

    def finish(self) -> list[np.ndarray]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []


class JoinedRows:
    """Several column sets side by side, row by row; see ``ColumnRows``."""

    def __init__(self, parts: Sequence[ColumnRows]) -> None:
        self._together = Together(parts)
        self.columns = self._together.columns
        self.lookahead_rows = self._together.lookahead_rows

    def push(self, values: np.ndarray) -> np.ndarray | None:
        """Return the columns of the row ``lookahead_rows`` before, (c,); see ``RowWise``."""
        found = self._together.push(values)
        return None if found is None else np.concatenate(found)

    def finish(self) -> list[np.ndarray]:
        """Return the columns of the last rows; see ``RowWise``."""
        return [np.concatenate(found) for found in self._together.finish()]
