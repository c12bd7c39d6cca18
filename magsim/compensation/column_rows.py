"""Column sets row by row: the same values as they give for a whole recording."""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from magsim.compensation.background import BackgroundField, Channel, FluxgateField
from magsim.compensation.background.rows import VectorRows
from magsim.compensation.columns import (
    AuxiliaryColumns,
    ChangeColumns,
    ChannelColumns,
    ColumnSet,
    Joined,
    PointColumns,
    TimeColumns,
    TollesLawsonColumns,
)
from magsim.compensation.platform_columns import PlatformColumns
from magsim.compensation.streaming import Feed
from magsim.compensation.streaming.columns import (
    ChangeRows,
    ColumnRows,
    JoinedRows,
    PointRows,
    TimeRows,
    TollesLawsonRows,
)
from magsim.compensation.streaming.together import Together


def rows_of(made: ColumnSet, feed: Feed) -> ColumnRows | None:
    """Return a column set row by row; None where it needs rows that come later without limit, or has no such form.

    Raises
    ------
    RequestError
        If it needs the date, and the feed has none.
    """
    if made.lookahead_rows is None:
        return None
    if isinstance(made, PlatformColumns):
        return rows_of(made.joined, feed)
    if isinstance(made, Joined):
        parts = [rows_of(one, feed) for one in made.sets]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        return known[0] if len(known) == 1 else JoinedRows(known)
    if isinstance(made, TollesLawsonColumns):
        return TollesLawsonRows(
            _vector_rows(made, feed), made.terms, made.strength_nt, feed.rate_hz, made.eddy == "field"
        )
    return _beside(made, feed)


def _beside(made: ColumnSet, feed: Feed) -> ColumnRows | None:
    """Return what stands beside Tolles-Lawson columns row by row."""
    if isinstance(made, AuxiliaryColumns):
        channels = [channel for channel in made.channels if isinstance(channel, Channel)]
        return AuxiliaryRows(_vector_rows(made.source, feed), channels, made.means, feed)
    if isinstance(made, ChannelColumns):
        return RawRows([channel for channel in made.channels if isinstance(channel, Channel)], feed)
    if isinstance(made, PointColumns):
        return PointRows(made)
    if isinstance(made, ChangeColumns):
        return ChangeRows(made, feed.rate_hz)
    return TimeRows(feed) if isinstance(made, TimeColumns) else None


def _vector_rows(made: TollesLawsonColumns, feed: Feed) -> VectorRows:
    background = FluxgateField(made.fluxgate) if made.field is None else cast("BackgroundField", made.field)
    return background.rows(feed)


class RawRows:
    """Channels as they are, row by row; see ``ChannelColumns``."""

    def __init__(self, channels: Sequence[Channel], feed: Feed) -> None:
        self._together = Together([channel.rows(feed.rate_hz) for channel in channels])
        self.columns = self._together.columns
        self.lookahead_rows = self._together.lookahead_rows

    def push(self, values: np.ndarray) -> np.ndarray | None:
        """Return the channels of the row, (k,); see ``RowWise``."""
        found = self._together.push(values)
        return None if found is None else np.array(found)

    def finish(self) -> list[np.ndarray]:
        """Return nothing, no row is due, and forget the zeros; see ``RowWise``."""
        return [np.array(found) for found in self._together.finish()]


class AuxiliaryRows:
    """Channels times direction cosines, row by row; see ``AuxiliaryColumns``.

    Parameters
    ----------
    vectors : RowWise of (x, y, z) [nT]
    channels : sequence of Channel
    means : sequence of float
    feed : Feed
    """

    def __init__(self, vectors: VectorRows, channels: Sequence[Channel], means: Sequence[float], feed: Feed) -> None:
        self._together = Together([vectors, *(channel.rows(feed.rate_hz) for channel in channels)])
        self._means = tuple(means)
        self.columns = self._together.columns
        self.lookahead_rows = self._together.lookahead_rows

    def push(self, values: np.ndarray) -> np.ndarray | None:
        """Return the columns of the row ``lookahead_rows`` before, (3 k,); see ``RowWise``."""
        found = self._together.push(values)
        return None if found is None else self._row(*found)

    def finish(self) -> list[np.ndarray]:
        """Return the columns of the last rows; see ``RowWise``."""
        return [self._row(*found) for found in self._together.finish()]

    def _row(self, vector: tuple[float, float, float], *channels: float) -> np.ndarray:
        x, y, z = vector
        length = math.sqrt(x * x + y * y + z * z)
        cosines = (x / length, y / length, z / length)
        return np.array(
            [(value - mean) * u for value, mean in zip(channels, self._means, strict=True) for u in cosines]
        )
