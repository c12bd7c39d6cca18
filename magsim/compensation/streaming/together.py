"""Several things that are made of the same rows, brought to the same row."""

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from magsim.compensation.streaming.protocol import RowWise


class Together:
    """Results of several parts for one row: a part that needs less look-ahead waits for the others.

    Attributes
    ----------
    columns : tuple of str
        Of all parts, each once.
    lookahead_rows : int
        The largest of the parts.
    """

    def __init__(self, parts: Sequence[RowWise[Any]]) -> None:
        self._parts = tuple(parts)
        self.columns = tuple(dict.fromkeys(name for part in parts for name in part.columns))
        self.lookahead_rows = max((part.lookahead_rows for part in parts), default=0)
        self._places = [np.array([self.columns.index(name) for name in part.columns], dtype=int) for part in parts]
        self._queues: list[deque[Any]] = [deque() for _ in parts]

    def push(self, values: np.ndarray) -> tuple[Any, ...] | None:
        """Return the results of all parts for the row ``lookahead_rows`` before; see ``RowWise``."""
        found = [part.push(values[places]) for part, places in zip(self._parts, self._places, strict=True)]
        for queue, result in zip(self._queues, found, strict=True):
            if result is not None:
                queue.append(result)
        return tuple(queue.popleft() for queue in self._queues) if all(self._queues) else None

    def finish(self) -> list[tuple[Any, ...]]:
        """Return the results of the last rows; see ``RowWise``."""
        for queue, part in zip(self._queues, self._parts, strict=True):
            queue.extend(part.finish())
        left = list(zip(*self._queues, strict=True))
        for queue in self._queues:
            queue.clear()
        return left
