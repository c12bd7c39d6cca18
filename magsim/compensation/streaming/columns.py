"""Column sets row by row: the same values as ``magsim.compensation.columns`` gives for a whole recording."""

import math
from collections.abc import Sequence

import numpy as np

from magsim import columns
from magsim.compensation.columns import AttitudeColumns, ColumnSet, Joined, TollesLawsonColumns
from magsim.compensation.columns.attitude import ANGLES
from magsim.compensation.columns.tolles_lawson import TERMS
from magsim.compensation.streaming.protocol import Feed, RowWise
from magsim.compensation.streaming.together import Together
from magsim.errors import DataError

ColumnRows = RowWise[np.ndarray]
"""Gives the columns of one row, (c,)."""

Vector = tuple[float, float, float]


def rows_of(made: ColumnSet, feed: Feed) -> ColumnRows | None:
    """Return a column set row by row; None for one that has no such form.

    Parameters
    ----------
    made : ColumnSet
    feed : Feed
    """
    if isinstance(made, Joined):
        parts = [rows_of(one, feed) for one in made.sets]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        return known[0] if len(known) == 1 else JoinedRows(known)
    if isinstance(made, AttitudeColumns):
        return AttitudeRows()
    if isinstance(made, TollesLawsonColumns) and made.lookahead_rows is not None and made.field is None:
        by_field = made.eddy == "field"
        return TollesLawsonRows(FluxgateRows(made.fluxgate), made.terms, made.strength_nt, feed.rate_hz, by_field)
    return None


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


class AttitudeRows:
    """Attitude as ``AttitudeColumns`` gives it, row by row; see ``ColumnRows``."""

    columns = tuple(columns.INS_ATTITUDE.name(angle=angle) for angle in ANGLES)
    lookahead_rows = 0

    def push(self, values: np.ndarray) -> np.ndarray:
        """Return roll, pitch, sine and cosine of the heading, (4,); see ``RowWise``."""
        roll, pitch, heading = np.radians(values)
        return np.array([roll, pitch, np.sin(heading), np.cos(heading)])

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
