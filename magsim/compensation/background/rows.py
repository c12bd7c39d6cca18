"""Backgrounds and channels row by row: what they give for a whole recording, with bounded memory."""

from collections import deque
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from magsim import columns
from magsim.compensation.streaming.protocol import Feed, RowWise
from magsim.earth import decimal_years, igrf
from magsim.errors import RequestError
from magsim.frames import rot_nb_from_attitude, rotate_back

Vector = tuple[float, float, float]


class Window:
    """The rows of a piece around one row, at rest before its first and after its last row, as ``Taps`` takes them.

    Parameters
    ----------
    history, lookahead : int
        Rows before and after.
    width : int
        Values of a row.
    """

    def __init__(self, history: int, lookahead: int, width: int) -> None:
        self._lookahead = lookahead
        self._rows = np.zeros((history + 1 + lookahead, width))
        self._due = 0
        self._is_begun = False

    def push(self, values: Sequence[float] | np.ndarray) -> np.ndarray | None:
        """Return the rows around the row ``lookahead`` before, (m, width), good until the next call; None at first."""
        if not self._is_begun:
            self._rows[:] = values
            self._is_begun = True
        else:
            self._shift(values)
        self._due += 1
        if self._due <= self._lookahead:
            return None
        self._due -= 1
        return self._rows

    def finish(self) -> list[np.ndarray]:
        """Return the rows around each of the last rows, and be ready for another piece."""
        left = []
        for number in range(self._due):
            # the first of them must come to its place; the others follow one by one
            for _ in range(self._lookahead + 1 - self._due if number == 0 else 1):
                self._shift(self._rows[-1].copy())
            left.append(self._rows.copy())
        self._due, self._is_begun = 0, False
        return left

    def _shift(self, values: Sequence[float] | np.ndarray) -> None:
        self._rows[:-1] = self._rows[1:]
        self._rows[-1] = values


class ChannelRows:
    """A channel, its zero followed as ``Channel`` does; see ``magsim.compensation.streaming.RowWise``.

    Parameters
    ----------
    name : str
    rest : float, optional
        See ``Channel``.
    mean_rows : int
        Rows that the mean is taken over.
    near : float
        How far it may be from the rest.
    """

    lookahead_rows = 0

    def __init__(self, name: str, rest: float | None, mean_rows: int, near: float) -> None:
        self.columns = (name,)
        self._rest, self._mean_rows, self._near = rest, mean_rows, near
        self.finish()

    def push(self, values: np.ndarray) -> float:
        """Return the channel; see ``RowWise``."""
        value = float(values[0])
        if self._rest is None:
            return value
        # the sums of a whole recording, to the bit: a threshold is compared with them
        self._totals.append(self._totals[-1] + value)
        full = len(self._totals) > self._mean_rows
        above = (self._totals[-1] - self._totals[0]) / (len(self._totals) - 1) - self._rest
        if full and abs(above) < self._near:
            self._zeros += above
            self._count += 1
        return value - self._zeros / max(self._count, 1)

    def finish(self) -> list[float]:
        """Return nothing, no row is due, and forget the zero; see ``RowWise``."""
        self._totals = deque([0.0], maxlen=self._mean_rows + 1)
        self._zeros, self._count = 0.0, 0
        return []


class CalibratedRows:
    """The background of a calibrated fluxgate, row by row; see ``CalibratedField``.

    Parameters
    ----------
    fluxgate : str
    channels : sequence of ChannelRows
    weights : (m, 3, 3) [nT / nT]
        Of the fluxgate's rows around a row: from an axis to an axis of the background.
    constant : (3,) [nT]
    matrix : (k, 3)
        Of the channels of the row itself.
    lookahead_rows : int
    """

    def __init__(
        self,
        fluxgate: str,
        channels: Sequence[ChannelRows],
        *,
        weights: np.ndarray,
        constant: np.ndarray,
        matrix: np.ndarray,
        lookahead_rows: int,
    ) -> None:
        names = (columns.FLUX.name(sensor=fluxgate, axis=axis) for axis in columns.AXES)
        self.columns = (*names, *(name for channel in channels for name in channel.columns))
        self.lookahead_rows = lookahead_rows
        self._channels = tuple(channels)
        self._weights = np.ascontiguousarray(weights.reshape(-1, 3).T)
        self._constant, self._matrix = constant, np.ascontiguousarray(matrix.T)
        self._window = Window(len(weights) - 1 - lookahead_rows, lookahead_rows, 3 + len(channels))

    def push(self, values: np.ndarray) -> Vector | None:
        """Return the background of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        row = values.copy()
        for i, channel in enumerate(self._channels, start=3):
            row[i] = channel.push(values[i : i + 1])
        window = self._window.push(row)
        return None if window is None else self._vector(window)

    def finish(self) -> list[Vector]:
        """Return the background of the last rows [nT]; see ``RowWise``."""
        for channel in self._channels:
            channel.finish()
        return [self._vector(window) for window in self._window.finish()]

    def _vector(self, window: np.ndarray) -> Vector:
        found = self._constant + self._weights @ window[:, :3].ravel()
        if self._channels:
            found = found + self._matrix @ window[-1 - self.lookahead_rows, 3:]
        x, y, z = found.tolist()
        return x, y, z


class ModelRows:
    """The model field in body axes, row by row; see ``ModelField``.

    Parameters
    ----------
    feed : Feed
        With the date.

    Raises
    ------
    RequestError
        If it has none.
    """

    lookahead_rows = 0
    columns = (
        columns.TIME,
        *(columns.INS_ATTITUDE.name(angle=angle) for angle in columns.INS_ANGLES),
        columns.INS_ALTITUDE.pattern,
    )

    def __init__(self, feed: Feed) -> None:
        if feed.start_utc is None:
            msg = "the model field needs the date: give the stream start_utc, the instant of time 0"
            raise RequestError(msg)
        self._start = datetime.fromisoformat(feed.start_utc)

    def push(self, values: np.ndarray) -> Vector:
        """Return the model field [nT]; see ``RowWise``."""
        angles = np.radians(values[None, 1:6])
        years = decimal_years(self._start, values[:1])
        field_n = igrf(angles[:, 3], angles[:, 4], values[6:7], years)
        x, y, z = rotate_back(rot_nb_from_attitude(angles[:, :3]), field_n)[0].tolist()
        return x, y, z

    def finish(self) -> list[Vector]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []


VectorRows = RowWise[Vector]
"""Gives the background of one row, (x, y, z) [nT]."""
