"""The general way: the method's own ``estimate`` on the few rows that an estimate needs."""

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from magsim.columns import TIME
from magsim.compensation.streaming.protocol import Feed
from magsim.recording import Recording

FAR = 1000.0
"""Steps of time between a row that stands alone and the rows that make it a recording."""


class WindowedStreamer:
    """Estimates each row from a short recording around it.

    Attributes
    ----------
    columns : tuple of str
    lookahead_rows : int
    """

    def __init__(
        self, estimate: Callable[[Recording], np.ndarray], feed: Feed, *, memory_rows: int, lookahead_rows: int
    ) -> None:
        self._estimate = estimate
        self._feed = feed
        self._meta = {} if feed.start_utc is None else {"start_utc": feed.start_utc}
        self.columns = (TIME, *feed.columns)
        self.lookahead_rows = lookahead_rows
        self._rows: deque[np.ndarray] = deque(maxlen=memory_rows + 1 + lookahead_rows)
        self._due = 0
        """Rows of the piece whose estimates have not come yet."""

    def push(self, values: np.ndarray) -> float | None:
        """Return the interference of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        self._rows.append(values)
        self._due += 1
        if self._due <= self.lookahead_rows:
            return None
        try:
            found = self._over(self._rows)
        except Exception:
            # a row that is refused leaves things as they were, but for the oldest row, which is not needed again
            self._rows.pop()
            self._due -= 1
            raise
        self._due -= 1
        return float(found[len(self._rows) - 1 - self.lookahead_rows])

    def finish(self) -> list[float]:
        """Return the interference of the last rows [nT]; see ``RowWise``."""
        found = self._over(self._rows)[len(self._rows) - self._due :] if self._due else np.zeros(0)
        self._rows.clear()
        self._due = 0
        return [float(value) for value in found]

    def _over(self, rows: Sequence[np.ndarray] | deque[np.ndarray]) -> np.ndarray:
        """Return the estimates of rows, (n,) [nT]."""
        table = np.array(rows)
        count = len(table)
        if count == 1:
            # a recording has two rows at least: a piece of one row stands alone before others
            table = np.repeat(table, 4, axis=0)
            table[:, 0] += np.array([0.0, FAR, FAR + 1.0, FAR + 2.0]) / self._feed.rate_hz
        data = dict(zip(self.columns[1:], table[:, 1:].T, strict=True))
        return self._estimate(Recording("stream", table[:, 0], data, self._meta))[:count]
