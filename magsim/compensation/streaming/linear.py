"""Linear methods row by row: columns times coefficients."""

import numpy as np

from magsim.compensation.streaming.protocol import RowWise


class LinearStreamer:
    """Columns times coefficients with a constant.

    Parameters
    ----------
    rows : RowWise of (c,)
    coefficients : (c,)
    offset_nt : float [nT]
    """

    def __init__(self, rows: RowWise[np.ndarray], coefficients: np.ndarray, offset_nt: float) -> None:
        self._rows = rows
        self._coefficients = np.ascontiguousarray(coefficients)
        self._offset_nt = offset_nt
        self.columns = rows.columns
        self.lookahead_rows = rows.lookahead_rows

    def push(self, values: np.ndarray) -> float | None:
        """Return the interference of the row ``lookahead_rows`` before [nT]; see ``RowWise``."""
        row = self._rows.push(values)
        return None if row is None else self._estimate(row)

    def finish(self) -> list[float]:
        """Return the interference of the last rows [nT]; see ``RowWise``."""
        return [self._estimate(row) for row in self._rows.finish()]

    def _estimate(self, row: np.ndarray) -> float:
        return float(self._coefficients @ row) + self._offset_nt


class ConstantStreamer:
    """The same interference for every row [nT]; reads nothing."""

    columns: tuple[str, ...] = ()
    lookahead_rows = 0

    def __init__(self, interference_nt: float) -> None:
        self._interference_nt = interference_nt

    def push(self, values: np.ndarray) -> float:
        """Return the constant; see ``RowWise``."""
        return self._interference_nt

    def finish(self) -> list[float]:
        """Return nothing: no row is due; see ``RowWise``."""
        return []
