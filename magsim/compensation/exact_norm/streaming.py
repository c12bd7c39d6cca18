"""The exact norm row by row: one window of rows, filters as sums over it, memory as states."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.compensation.background import CalibratedField, Channel, taps
from magsim.compensation.background.rows import VectorRows, Window
from magsim.compensation.background.taps import HISTORY_ROWS
from magsim.compensation.exact_norm.memory import WIDTHS_NT
from magsim.compensation.exact_norm.sources import Sources
from magsim.compensation.recursive.streamer import LearningStreamer
from magsim.compensation.streaming import Feed, FluxgateRows


class EstimatedRow(NamedTuple):
    """What is known of one row.

    Attributes
    ----------
    interference_nt : float [nT]
        Without a constant.
    direction : (3,)
        Of the total field: how the interference changes with a permanent field.
    """

    interference_nt: float
    direction: np.ndarray


class ExactNormRows:
    """Interference, direction and background row by row; see ``magsim.compensation.streaming.RowWise``.

    Parameters
    ----------
    sources : Sources
    coefficients : (s, 3)
    feed : Feed
    """

    def __init__(self, sources: Sources, coefficients: np.ndarray, feed: Feed) -> None:
        self.lookahead_rows = sources.lookahead_rows
        self._coefficients = coefficients
        channels = _all_channels(sources)
        self._own = len(sources.channels)
        self._vectors = _vectors(sources, feed)
        self._channels = [channel.rows(feed.rate_hz) for channel in channels]
        self.columns = (*self._vectors.columns, *(channel.name for channel in channels))
        self._filters, self._bends = _filters(sources, round(feed.rate_hz, 6))
        self._constant, self._gain, self._rate, self._seen = _background(sources, channels)
        self._widths = np.array(WIDTHS_NT)[:, None] if sources.memory else np.zeros((0, 1))
        self._window = Window(HISTORY_ROWS, self.lookahead_rows, 3 + len(channels))
        self._states: np.ndarray | None = None

    def push(self, values: np.ndarray) -> EstimatedRow | None:
        """Return what is known of the row ``lookahead_rows`` before; see ``RowWise``."""
        first = len(self._vectors.columns)
        vector = self._vectors.push(values[:first])
        assert vector is not None  # what is read has no look-ahead of its own
        row = [*vector]
        row += [rows.push(values[at : at + 1]) for at, rows in enumerate(self._channels, start=first)]
        window = self._window.push(row)
        return None if window is None else self._estimate(window)

    def finish(self) -> list[EstimatedRow]:
        """Return what is known of the last rows; see ``RowWise``."""
        found = [self._estimate(window) for window in self._window.finish()]
        self._states = None
        for rows in self._channels:
            rows.finish()
        return found

    def _estimate(self, window: np.ndarray) -> EstimatedRow:
        here = window[HISTORY_ROWS, 3:]
        motion = self._filters @ window[:, :3]
        field = motion[:3] @ self._gain + motion[1:] @ self._rate  # background and its two derivatives
        field[0] += self._constant
        if len(here):
            field[0] += here @ self._seen
            field[1:] += (self._bends @ window[:, 3:]) @ self._seen
        parts = [np.ones(1), field.ravel()]
        if len(self._widths):
            held = field[0] if self._states is None else self._states
            self._states = np.minimum(np.maximum(held, field[0] - self._widths), field[0] + self._widths)
            parts.append(self._states.sum(axis=0) / len(self._widths))
        own = np.concatenate([*parts, here[: self._own]]) @ self._coefficients
        total = field[0] + own
        whole, length = np.sqrt(total @ total), np.sqrt(field[0] @ field[0])
        return EstimatedRow(float(own @ (total + field[0]) / (whole + length)), total / whole)


class ExactNormStreamer:
    """The exact norm row by row; see ``magsim.compensation.streaming.Streamer``.

    Parameters
    ----------
    rows : ExactNormRows
    offset_nt : float [nT]
    """

    def __init__(self, rows: ExactNormRows, offset_nt: float) -> None:
        self._rows, self._offset_nt = rows, offset_nt
        self.columns, self.lookahead_rows = rows.columns, rows.lookahead_rows

    def push(self, values: np.ndarray) -> float | None:
        """Return the interference of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        found = self._rows.push(values)
        return None if found is None else found.interference_nt + self._offset_nt

    def finish(self) -> list[float]:
        """Return the interference of the last rows [nT]; see ``RowWise``."""
        return [found.interference_nt + self._offset_nt for found in self._rows.finish()]


class AdaptiveStreamer(LearningStreamer[EstimatedRow]):
    """The exact norm with a permanent field that follows the flight.

    What is learned from is the compensated reading, in band, against the direction of the field: the background of the
    fluxgate would bring its own changes.
    """

    def _take(self, row: EstimatedRow, reading_nt: float) -> float:
        change = float(self._adaptation.coefficients @ row.direction)
        self._adaptation.learn(row.direction, reading_nt - row.interference_nt)
        return row.interference_nt + change + self._offset_nt


def _all_channels(sources: Sources) -> tuple[Channel, ...]:
    """Return the channels of the sources, then those that the background alone reads."""
    background = sources.background
    seen = background.regressors.channels if isinstance(background, CalibratedField) else ()
    names = {channel.name for channel in sources.channels}
    return (*sources.channels, *(channel for channel in seen if channel.name not in names))


def _vectors(sources: Sources, feed: Feed) -> VectorRows:
    """Return what makes the vector of each row: the reading of the fluxgate, or a background of that row alone."""
    background = sources.background
    return (
        FluxgateRows(background.regressors.fluxgate)
        if isinstance(background, CalibratedField)
        else background.rows(feed)
    )


def _filters(sources: Sources, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the filters of the vector and its three derivatives, (4, w), and of the channels' two, (2, w)."""
    background, later_s, lookahead = sources.background, sources.shape.later_s, sources.lookahead_rows
    calibrated = isinstance(background, CalibratedField)
    lag_s = background.lag_s if isinstance(background, CalibratedField) else 0.0
    filters = np.zeros((4, HISTORY_ROWS + 1 + lookahead))
    for order in range(4 if calibrated else 3):
        filters[order] = taps(order, lag_s + later_s, lookahead, rate_hz).weights
    if isinstance(background, CalibratedField):
        filters[0] += background.curvature_s2 * filters[2]
    return filters, np.array([taps(order, 0.0, lookahead, rate_hz).weights for order in (1, 2)])


def _background(sources: Sources, channels: Sequence[Channel]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what makes the background: constant (3,), of the vector (3, 3), of its rate (3, 3), of channels (k, 3)."""
    background = sources.background
    seen = np.zeros((len(channels), len(columns.AXES)))
    if not isinstance(background, CalibratedField):
        return np.zeros(3), np.eye(3), np.zeros((3, 3)), seen
    matrix = background.matrix
    places = {channel.name: number for number, channel in enumerate(channels)}
    for channel, row in zip(background.regressors.channels, matrix[7:], strict=True):
        seen[places[channel.name]] = row
    return matrix[0], matrix[1:4], matrix[4:7], seen
