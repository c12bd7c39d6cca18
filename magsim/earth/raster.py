"""A smooth surface through values on a regular grid.

Between the points it is the bicubic convolution of Keys (1981, IEEE Trans. ASSP 29, 1153, a = -1/2): it goes through
every point, has a continuous slope, and gives back planes and parabolas exactly.
"""

import numpy as np


class Raster:
    """Values on a regular grid, with a smooth surface between the points.

    Parameters
    ----------
    values : (rows, columns)
        The first row is the southernmost, the first column the westernmost.
    west, south : float
        Place of the first point, in degrees or in meters.
    step : float
        Distance of the points in the same unit.
    """

    def __init__(self, values: np.ndarray, west: float, south: float, step: float) -> None:
        self.west, self.south, self.step = west, south, step
        self.values = np.array(values, dtype=float)
        self.values.flags.writeable = False
        # One more point on each side, on the straight line of the last two.
        table = np.pad(self.values, 1)
        table[0], table[-1] = 2.0 * table[1] - table[2], 2.0 * table[-2] - table[-3]
        table[:, 0], table[:, -1] = 2.0 * table[:, 1] - table[:, 2], 2.0 * table[:, -2] - table[:, -3]
        self.table = table

    @property
    def north(self) -> float:
        """Place of the northernmost row."""
        return self.south + (self.values.shape[0] - 1) * self.step

    @property
    def east(self) -> float:
        """Place of the easternmost column."""
        return self.west + (self.values.shape[1] - 1) * self.step

    def turned(self, lon_deg: np.ndarray) -> np.ndarray:
        """Return longitudes in the grid's own turn, (...) [deg]: it may cross the date line."""
        return self.west - 1e-9 + np.mod(lon_deg - self.west + 1e-9, 360.0)

    def inside(self, y: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Mark the places that lie on the grid, (...) bool."""
        row, column = self._place(y, x)
        rows, columns = self.values.shape
        return (row > -1e-6) & (row < rows - 1 + 1e-6) & (column > -1e-6) & (column < columns - 1 + 1e-6)

    def lookup(self, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the value and its slopes along y and x, (...) each; places must be ``inside``."""
        row, column = self._place(y, x)
        rows, columns = self.values.shape
        i = np.clip(np.floor(row).astype(int), 0, rows - 2)
        j = np.clip(np.floor(column).astype(int), 0, columns - 2)
        wy, dy = _keys(row - i)
        wx, dx = _keys(column - j)
        value, by_y, by_x = np.zeros(row.shape), np.zeros(row.shape), np.zeros(row.shape)
        for a in range(4):
            line, along = np.zeros(row.shape), np.zeros(row.shape)
            for b in range(4):
                point = self.table[i + a, j + b]
                line += wx[b] * point
                along += dx[b] * point
            value += wy[a] * line
            by_y += dy[a] * line
            by_x += wy[a] * along
        return value, by_y / self.step, by_x / self.step

    def _place(self, y: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column of places, with fractions."""
        row, column = np.broadcast_arrays((y - self.south) / self.step, (x - self.west) / self.step)
        return row, column


def _keys(t: np.ndarray) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Return weights of the four points around a place between the two middle ones, and their derivatives."""
    t2, t3 = t * t, t * t * t
    weights = (
        -0.5 * t3 + t2 - 0.5 * t,
        1.5 * t3 - 2.5 * t2 + 1.0,
        -1.5 * t3 + 2.0 * t2 + 0.5 * t,
        0.5 * t3 - 0.5 * t2,
    )
    slopes = (-1.5 * t2 + 2.0 * t - 0.5, 4.5 * t2 - 5.0 * t, -4.5 * t2 + 4.0 * t + 0.5, 1.5 * t2 - t)
    return weights, slopes
