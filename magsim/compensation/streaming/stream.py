"""The stream of a fitted method: order and time of rows, gaps, and which estimate belongs to which row."""

import math
from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from magsim.columns import MAG, TIME
from magsim.compensation.streaming.protocol import Estimate, Streamer
from magsim.errors import DataError, RequestError

GAP = 1.5
"""Steps of time that end a piece: the rule of ``magsim.signals.spans``."""

OFF_RATE = 0.1
"""Share by which a step of time may differ from that of the rate."""

MOST_OFF = 20
"""So many steps in turn that differ from the rate are no jitter and no gaps: the rate is wrong."""


class Stream:
    """Compensates one row after the other; ``Compensator.stream`` makes one.

    Each row that is pushed gives the estimate of the row ``lookahead_rows`` before it, and ``finish`` gives the rest.
    The estimates are those of ``Compensator.interference`` within 1e-9 nT. A step of time of more than 1.5 rows is a
    gap: what comes after it is a new piece, as it is in a recording.

    Attributes
    ----------
    columns : tuple of str
        What a row must have, in the order of ``push_values``; ``time_s`` is the first.
    lookahead_rows : int
    sensor : str
        The scalar magnetometer whose reading is compensated.
    rate_hz : float [Hz]
    """

    def __init__(self, make: Callable[[], Streamer], *, sensor: str, rate_hz: float) -> None:
        self._make = make
        self._streamer = streamer = make()
        self.sensor = sensor
        reading = MAG.name(sensor=sensor)
        self.columns = tuple(dict.fromkeys((TIME, *streamer.columns, reading)))
        self.lookahead_rows = streamer.lookahead_rows
        self.rate_hz = rate_hz
        self._own = np.array([self.columns.index(name) for name in streamer.columns], dtype=int)
        self._reading = self.columns.index(reading)
        self._waiting: deque[tuple[float, float]] = deque()
        """Time and reading of the rows whose estimates have not come yet."""
        self._ready: deque[Estimate] = deque()
        self._last_s: float | None = None
        self._off = 0

    def push(self, row: Mapping[str, float]) -> Estimate | None:
        """Take the next row by the names of its columns; see ``push_values``. Columns that are not needed may be there.

        Raises
        ------
        RequestError
            If a column is missing, or holds no number.
        """
        try:
            values = np.array([row[name] for name in self.columns], dtype=float)
        except KeyError:
            missing = ", ".join(name for name in self.columns if name not in row)
            msg = f"the row has no column {missing}; needed: {', '.join(self.columns)}"
            raise RequestError(msg) from None
        except (TypeError, ValueError):
            wrong = next(name for name in self.columns if not _is_number(row[name]))
            msg = f"the row has {wrong} = {row[wrong]!r}; allowed: a number"
            raise RequestError(msg) from None
        return self.push_values(values)

    def push_values(self, values: np.ndarray) -> Estimate | None:
        """Take the next row.

        A row that is refused is not taken: the stream stays as it was, and the next row may come.

        Parameters
        ----------
        values : (c,)
            In the order of ``columns``.

        Returns
        -------
        Estimate or None
            Of the row ``lookahead_rows`` before; None for the first rows.

        Raises
        ------
        RequestError
            If there are fewer or more values than columns.
        DataError
            If the time does not increase, a value that the method reads is not finite or not possible, or the rows
            come at another rate.
        """
        if len(values) != len(self.columns):
            msg = f"the row has {len(values)} values; expected {len(self.columns)}: {', '.join(self.columns)}"
            raise RequestError(msg)
        time_s = float(values[0])
        inputs = values[self._own]
        if not (math.isfinite(time_s) and np.isfinite(inputs).all()):
            self._refuse(values)
        is_gap = self._is_gap(time_s)
        if is_gap:
            self._end_piece()
        found = self._streamer.push(inputs)
        self._last_s = time_s
        self._waiting.append((time_s, float(values[self._reading])))
        if found is not None:
            self._release(found)
        behind = len(self._waiting) + len(self._ready)
        return self._ready.popleft() if behind > self.lookahead_rows else None

    def finish(self) -> list[Estimate]:
        """Return the estimates that are still due, in order; the next row begins anew, at whatever time."""
        self._end_piece()
        self._streamer = self._make()
        self._last_s, self._off = None, 0
        left = list(self._ready)
        self._ready.clear()
        return left

    def _is_gap(self, time_s: float) -> bool:
        """Return whether a row begins a new piece.

        Raises
        ------
        DataError
            If it is not later than the row before, or the rate is wrong.
        """
        if self._last_s is None:
            return False
        step_s = time_s - self._last_s
        if step_s <= 0.0:
            msg = f"time_s {time_s:.10g} does not come after {self._last_s:.10g}; rows come in the order of time"
            raise DataError(msg)
        steps = step_s * self.rate_hz
        self._off = self._off + 1 if abs(steps - 1.0) > OFF_RATE else 0
        if self._off >= MOST_OFF:
            msg = (
                f"time_s {time_s:.10g}: the last {self._off} rows did not come {1.0 / self.rate_hz:g} s apart; this "
                f"one comes {step_s:.4g} s after the row before. rate_hz is {self.rate_hz:g}: it must be that of the "
                "rows"
            )
            raise DataError(msg)
        return steps > GAP

    def _end_piece(self) -> None:
        for found in self._streamer.finish():
            self._release(found)

    def _release(self, interference_nt: float) -> None:
        time_s, reading_nt = self._waiting.popleft()
        self._ready.append(Estimate(time_s, interference_nt, reading_nt - interference_nt))

    def _refuse(self, values: np.ndarray) -> None:
        for i in (0, *self._own.tolist()):
            if not math.isfinite(values[i]):
                msg = (
                    f"{self.columns[i]} is {values[i]:g} in the row of time_s {values[0]:.10g}; allowed: finite numbers"
                )
                raise DataError(msg)


def _is_number(value: object) -> bool:
    try:
        float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    return True
