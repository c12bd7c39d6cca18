"""The columns of the platform row by row: the same values as ``PlatformColumns`` gives for a whole recording."""

import math
from collections.abc import Sequence

import numpy as np

from magsim.compensation.background import Channel, FluxgateField
from magsim.compensation.background.rows import VectorRows
from magsim.compensation.platform_columns import PlatformColumns
from magsim.compensation.streaming import Feed
from magsim.compensation.streaming.columns import ColumnRows, JoinedRows, TollesLawsonRows
from magsim.compensation.streaming.together import Together


def platform_rows(made: PlatformColumns, feed: Feed) -> ColumnRows | None:
    """Return columns row by row; None where they need rows that come later without limit.

    Raises
    ------
    RequestError
        If the direction needs the date, and the feed has none.
    """
    if made.lookahead_rows is None:
        return None
    tolles_lawson, background = made.tolles_lawson, made.background or FluxgateField(made.tolles_lawson.fluxgate)
    by_field = tolles_lawson.eddy == "field"
    own = TollesLawsonRows(
        background.rows(feed), tolles_lawson.terms, tolles_lawson.strength_nt, feed.rate_hz, by_field
    )
    if made.auxiliary is None:
        return own
    channels = [channel for channel in made.auxiliary.channels if isinstance(channel, Channel)]
    return JoinedRows([own, AuxiliaryRows(background.rows(feed), channels, made.auxiliary.means, feed)])


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
