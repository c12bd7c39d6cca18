"""What is learned in flight: the change of coefficients since the fit.

The least squares that are solved after each row are

    min  anchor_s mean |z_k . d|^2  +  sum_i keep^(now - i) w_i (y_i - x_i . (b + d))^2 / rate

with the coefficients b of the fit, their change d, band-passed rows x and readings y of the flight, and the mean over
the rows z of the training. The first term is never forgotten: the training counts as ``anchor_s`` seconds of flight for
ever. So the matrix that is solved has no eigenvalue below that of the first term, whatever is flown or not flown, and
an exponentially weighted sum of squares forgets its own rounding too: there is nothing that could blow up or lose its
symmetry, as the covariance of the usual recursion does. The solution by Cholesky's decomposition costs some 700
multiplications for 16 columns.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import signal

from magsim.signals import BAND_HZ, EDGE_S

ORDER = 4
"""Order of the prototype of the causal band-pass: that of ``magsim.signals.band_pass``, in one direction."""

LIMIT = 2.0
"""Errors beyond so many deviations count less, as 1 / error^2: an anomaly is far off and hardly counts."""

MEDIAN = 0.6745
"""Median of the magnitude of a normal deviate."""

SPEED_PER_S = 0.1
"""How fast the deviation of the errors is followed, at most: by 10 % a second."""

HELD_ROWS = 5
"""So many equal readings in turn are a dropout, with the last reading repeated."""

RIDGE = 1e-9
"""Smallest weight of no change, relative to the mean of the columns': for columns that training did not excite."""


@dataclass(frozen=True)
class Known:
    """What the fit leaves to the flight.

    Attributes
    ----------
    coefficients : (c,)
    scale : (c,)
        Deviation of each column in band, over the training.
    products : (c, c)
        Mean products of scaled band-passed columns over the training.
    deviation_nt : float [nT]
        Of the misfit of the fit in band, from the median.
    """

    coefficients: np.ndarray
    scale: np.ndarray
    products: np.ndarray
    deviation_nt: float

    @classmethod
    def of(cls, rows: np.ndarray, readings: np.ndarray, coefficients: np.ndarray) -> "Known":
        """Take it from band-passed rows, (n, c), and readings, (n,) [nT], of the training."""
        scale = np.sqrt(np.mean(rows**2, axis=0))
        scale = np.where(scale > 0.0, scale, 1.0)
        scaled = rows / scale
        misfit = readings - np.einsum("nc,c->n", rows, coefficients)
        products = np.einsum("ni,nj->ij", scaled, scaled, optimize=False) / len(rows)
        return cls(coefficients, scale, products, max(float(np.median(np.abs(misfit))) / MEDIAN, 1e-6))


@dataclass(frozen=True)
class CausalBand:
    """The band of compensation, filtered forward alone: what it gives at a row needs no later one.

    Attributes
    ----------
    rate_hz : float
    """

    rate_hz: float

    @cached_property
    def sos(self) -> np.ndarray:
        """Second-order sections, (k, 6)."""
        return np.ascontiguousarray(signal.butter(ORDER, BAND_HZ, "bandpass", fs=self.rate_hz, output="sos"))

    @cached_property
    def steady(self) -> np.ndarray:
        """States for a constant input of 1, (k, 2)."""
        return signal.sosfilt_zi(self.sos)

    @property
    def settling_rows(self) -> int:
        """Rows that a step spoils."""
        return round(EDGE_S * self.rate_hz)

    def begun(self, channels: np.ndarray) -> np.ndarray:
        """Return states in the steady state of a first row of channels (c,), (k, 2, c)."""
        return np.ascontiguousarray(self.steady[:, :, None] * channels)

    def __call__(self, table: np.ndarray) -> np.ndarray:
        """Filter a piece, (n, c)."""
        return signal.sosfilt(self.sos, table, axis=0, zi=self.begun(table[0]))[0]


class Adaptation:
    """The change of the coefficients, learned row by row.

    Parameters
    ----------
    known : Known
    rate_hz : float
    forgetting_s : float [s]
        Time in which what was learned in flight loses its weight by e.
    anchor_s : float [s]
        Seconds of flight that the training counts as.

    Attributes
    ----------
    coefficients : (c,)
        Of the present.
    """

    def __init__(self, known: Known, rate_hz: float, *, forgetting_s: float, anchor_s: float) -> None:
        from magsim.compensation.recursive import kernel

        self._kernel = kernel
        self._known = known
        self._band = CausalBand(rate_hz)
        count = len(known.scale)
        floor = RIDGE * float(np.trace(known.products)) / count
        self._anchor = anchor_s * rate_hz * (known.products + floor * np.eye(count))
        self._keep = float(np.exp(-1.0 / (forgetting_s * rate_hz)))
        self._information = np.zeros((count, count))
        self._right, self._change = np.zeros(count), np.zeros(count)
        self._room = np.zeros((count, count))
        self._deviation_nt = known.deviation_nt
        self._states: np.ndarray | None = None
        self._since = 0
        """Rows since the last break: the begin of the piece, or a dropout."""
        self._same = 0
        self._last_nt = np.nan
        self.coefficients = known.coefficients.copy()

    def end_piece(self) -> None:
        """Forget the filter and keep what was learned: a gap in time follows."""
        self._states = None
        self._last_nt = np.nan

    def learn(self, row: np.ndarray, reading_nt: float) -> None:
        """Take the next row of a piece: columns, (c,), and the reading [nT]."""
        channels = np.append(row, reading_nt)
        if self._states is None:
            self._states = self._band.begun(channels)
            self._since = self._same = 0
        self._kernel.filtered(self._band.sos, self._states, channels)
        self._same = self._same + 1 if reading_nt == self._last_nt else 0
        self._last_nt = reading_nt
        self._since = 0 if self._same >= HELD_ROWS else self._since + 1
        if self._since > self._band.settling_rows:
            self._update(channels)

    def _update(self, channels: np.ndarray) -> None:
        known = self._known
        filtered = channels[:-1]
        misfit_nt = float(channels[-1] - filtered @ known.coefficients)
        error_nt = self._kernel.updated(
            self._anchor,
            self._information,
            self._right,
            filtered / known.scale,
            misfit_nt,
            self._keep,
            LIMIT * self._deviation_nt,
            self._change,
            self._room,
        )
        self.coefficients = known.coefficients + self._change / known.scale
        # follows the median of the magnitude, smoothly, so that rounding decides nothing
        pull = min(max(abs(error_nt) / (MEDIAN * self._deviation_nt) - 1.0, -1.0), 1.0)
        followed = self._deviation_nt * float(np.exp(SPEED_PER_S * pull / self._band.rate_hz))
        self._deviation_nt = max(followed, known.deviation_nt)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the coefficients, (c, c), were the errors white and of the deviation that is followed."""
        lower = np.tril(self._information)
        whole = self._anchor + lower + np.tril(lower, -1).T
        inverse = np.linalg.inv(np.linalg.cholesky(whole))
        scaled = inverse.T @ inverse * self._deviation_nt**2
        return scaled / np.outer(self._known.scale, self._known.scale)
