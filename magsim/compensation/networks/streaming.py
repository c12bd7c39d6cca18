"""A network row by row: its columns, its window, and the first stage beside it."""

from copy import deepcopy

import numpy as np
import torch

from magsim.compensation.column_rows import rows_of
from magsim.compensation.networks.fitted import Fitted, check_rate_hz
from magsim.compensation.networks.windows import platform_of
from magsim.compensation.streaming import ColumnRows, Feed, Streamer, Together


class NetworkRows:
    """The network's part of the interference, row by row [nT]; see ``magsim.compensation.streaming.Streamer``.

    Parameters
    ----------
    fitted : Fitted
    rows : RowWise of (c,)
        Its input columns.
    context : int
        Rows that an output is made from; NaN until there are as many.
    """

    def __init__(self, fitted: Fitted, rows: ColumnRows, context: int) -> None:
        self._fitted = fitted
        self._platform = platform_of(deepcopy(fitted.module).double().eval())
        self._rows = rows
        self._held = np.zeros((1, len(fitted.names), context))
        self._count = 0
        self.columns = rows.columns
        self.lookahead_rows = rows.lookahead_rows

    def push(self, values: np.ndarray) -> float | None:
        """Return the output for the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        row = self._rows.push(values)
        return None if row is None else self._output(row)

    def finish(self) -> list[float]:
        """Return the outputs for the last rows [nT]; see ``RowWise``."""
        left = [self._output(row) for row in self._rows.finish()]
        self._count = 0
        return left

    def _output(self, row: np.ndarray) -> float:
        held = self._held
        held[:, :, :-1] = held[:, :, 1:]
        held[0, :, -1] = self._fitted.standardizer(row)
        self._count += 1
        if self._count < held.shape[2]:
            return float("nan")
        with torch.no_grad():
            out = float(self._platform(torch.from_numpy(held))[0, 0])
        return self._fitted.mean + self._fitted.gain_nt * out


class StagedStreamer:
    """First stage plus network; see ``magsim.compensation.streaming.Streamer``."""

    def __init__(self, stage: Streamer, network: NetworkRows) -> None:
        self._together = Together([stage, network])
        self.columns = self._together.columns
        self.lookahead_rows = self._together.lookahead_rows

    def push(self, values: np.ndarray) -> float | None:
        """Return the interference of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        found = self._together.push(values)
        return None if found is None else found[0] + found[1]

    def finish(self) -> list[float]:
        """Return the interference of the last rows [nT]; see ``RowWise``."""
        return [stage + network for stage, network in self._together.finish()]


def network_streamer(fitted: Fitted, feed: Feed, *, context: int) -> StagedStreamer | None:
    """Return a trained pair of stage and network row by row; None if its columns have no such form.

    Raises
    ------
    DataError
        If the rows come at another rate than the training rows.
    """
    check_rate_hz("stream", feed.rate_hz, fitted.rate_hz)
    rows, stage = rows_of(fitted.columns.joined, feed), fitted.stage._streamer(feed)
    return None if rows is None or stage is None else StagedStreamer(stage, NetworkRows(fitted, rows, context))
