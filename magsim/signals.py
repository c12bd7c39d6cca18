"""Filters, derivatives and drift that everyone shares: pure functions of evenly sampled arrays.

Time runs along the first axis; further axes are columns. Sampling rates are in Hz.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

BAND_HZ = (0.1, 0.6)
"""Edges of the band that compensation is judged in [Hz]; amplitude gain 0.5 there, forward and backward."""

HIGH_PASS_HZ = 0.03
"""Edge of the high-pass of paper 002 [Hz]."""

ORDER = 4
"""Order of the Butterworth prototypes."""

EDGE_S = 30.0
"""What the band-pass, forward and backward, spoils at each end of what it filters, and what scores leave out [s]."""

HIGH_PASS_EDGE_S = 60.0
"""The same of the high-pass, whose lower edge makes it longer: 30 s would leave up to 6 % of the STD on a field that
rises along the way, 60 s leave less than 1 % [s]."""


@lru_cache(maxsize=32)
def _butter(edges_hz: tuple[float, ...], kind: str, rate_hz: float) -> np.ndarray:
    edges = edges_hz[0] if len(edges_hz) == 1 else edges_hz
    return signal.butter(ORDER, edges, kind, fs=rate_hz, output="sos")


def _forward_backward(values: np.ndarray, edges_hz: tuple[float, ...], kind: str, rate_hz: float) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    # scipy's default run-out at the ends, cut where the signal is shorter than it.
    sos = _butter(edges_hz, kind, float(rate_hz))
    pad = min(3 * (2 * len(sos) + 1), len(values) - 1)
    return signal.sosfiltfilt(sos, values, axis=0, padlen=pad)


def band_pass(values: np.ndarray, rate_hz: float, band_hz: tuple[float, float] = BAND_HZ) -> np.ndarray:
    """Butterworth band-pass of order 4, forward and backward (zero phase).

    Parameters
    ----------
    values : (n, ...)
        Without gaps; filter a whole flight and crop afterward, never across a gap.
    rate_hz : float [Hz]
    band_hz : (low, high) [Hz]
        Amplitude gain is 0.5 at both edges (each direction gives sqrt(0.5)).

    Returns
    -------
    (n, ...)
    """
    return _forward_backward(values, tuple(band_hz), "bandpass", rate_hz)


def high_pass(values: np.ndarray, rate_hz: float, edge_hz: float = HIGH_PASS_HZ) -> np.ndarray:
    """Butterworth high-pass of order 4, forward and backward (zero phase); amplitude gain 0.5 at the edge.

    Parameters
    ----------
    values : (n, ...)
    rate_hz, edge_hz : float [Hz]

    Returns
    -------
    (n, ...)
    """
    return _forward_backward(values, (float(edge_hz),), "highpass", rate_hz)


def derivative(values: np.ndarray, rate_hz: float) -> np.ndarray:
    """Derivative by time from central differences (one-sided at the ends), per second.

    Parameters
    ----------
    values : (n, ...)
        At least 2 samples.
    rate_hz : float [Hz]

    Returns
    -------
    (n, ...) [unit of values / s]
        Gain of a sine of frequency f: ``sin(2 pi f / rate) / (2 pi f / rate)``.
    """
    return np.gradient(np.asarray(values, dtype=float), 1.0 / rate_hz, axis=0)


def spline_derivative(values: np.ndarray, rate_hz: float) -> np.ndarray:
    """Derivative by time of the cubic spline through the samples, per second.

    Parameters
    ----------
    values : (n, ...)
        At least 4 samples.
    rate_hz : float [Hz]

    Returns
    -------
    (n, ...) [unit of values / s]
        At 0.6 Hz and 10 Hz sampling 0.01 % from exact, where central differences are 2.3 % low.
    """
    values = np.asarray(values, dtype=float)
    time = np.arange(len(values)) / rate_hz
    return CubicSpline(time, values, axis=0)(time, 1)


PASS_EDGE, STOP_EDGE = 0.25, 0.5
"""Edges of the anti-alias filter over the output rate."""

STOP_DB = 86.0
"""Design attenuation of the anti-alias filter [dB]; the pass band ripples by the same amount."""


def run_in_s(rate_out_hz: float) -> float:
    """Time before the first and after the last output row that a ``Decimator`` reads, at most [s].

    True for every input rate of at least 3 times the output rate.
    """
    return 13.0 / rate_out_hz


@dataclass(frozen=True)
class Decimator:
    """Anti-alias filter and decimation of a recording system: centered, linear phase, no delay.

    A Kaiser-window FIR low-pass: gain exactly 1 at zero, within 1e-4 of 1 up to a quarter of the output rate
    (2.5 Hz at 10 Hz out), at least 80 dB down from half of the output rate on, so that nothing folds back.
    Only the wanted output rows are computed.

    Attributes
    ----------
    rate_in_hz : float
    rate_out_hz : float
        Divides ``rate_in_hz``.

    Raises
    ------
    ValueError
        If the output rate does not divide the input rate.
    """

    rate_in_hz: float
    rate_out_hz: float

    def __post_init__(self) -> None:
        ratio = self.rate_in_hz / self.rate_out_hz
        if not (round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-6):
            msg = f"{self.rate_out_hz:g} Hz out does not divide {self.rate_in_hz:g} Hz in"
            raise ValueError(msg)

    @property
    def factor(self) -> int:
        """Input samples for each output row."""
        return round(self.rate_in_hz / self.rate_out_hz)

    @cached_property
    def taps(self) -> np.ndarray:
        """Impulse response, (2 half + 1,), symmetric, sum 1."""
        width = (STOP_EDGE - PASS_EDGE) * self.rate_out_hz / (self.rate_in_hz / 2.0)
        count, beta = signal.kaiserord(STOP_DB, width)
        taps = signal.firwin(
            count | 1,
            (STOP_EDGE + PASS_EDGE) / 2.0 * self.rate_out_hz,
            window=("kaiser", beta),
            fs=self.rate_in_hz,
        )
        taps = (taps + taps[::-1]) / 2.0
        taps /= taps.sum()
        taps.flags.writeable = False
        return taps

    @property
    def half(self) -> int:
        """Input samples that are read on each side of an output row: the run-in the caller provides."""
        return len(self.taps) // 2

    @property
    def description(self) -> str:
        """The response in words, for provenance."""
        return (
            f"linear-phase FIR low-pass, Kaiser window, {len(self.taps)} taps at {self.rate_in_hz:g} Hz, centered; "
            f"gain within 1e-4 of 1 up to {PASS_EDGE * self.rate_out_hz:g} Hz, 80 dB down from "
            f"{STOP_EDGE * self.rate_out_hz:g} Hz; then 1 of {self.factor} samples"
        )

    def everywhere(self, values: np.ndarray) -> np.ndarray:
        """The filtered signal at every input sample that has its run-in, (n - 2 half,) from a column (n,).

        Its sample ``i`` belongs to the instant of input sample ``i + half``.
        """
        windows = np.lib.stride_tricks.sliding_window_view(np.ascontiguousarray(values), len(self.taps))
        return np.einsum("nk,k->n", windows, self.taps)

    def rows_of(self, size: int, first: int) -> int:
        """How many output rows an input of ``size`` samples can give, the first centered on sample ``first``."""
        return max(0, (size - 1 - self.half - first) // self.factor + 1)

    def __call__(self, values: np.ndarray, first: int | None = None, rows: int | None = None) -> np.ndarray:
        """Filter and decimate.

        Parameters
        ----------
        values : (n, ...)
            At the input rate.
        first : int
            Sample that the first output row is centered on; at least ``half``, which is also the default.
        rows : int
            How many output rows; by default as many as the input allows.

        Returns
        -------
        (rows, ...)
            Row ``i`` belongs to the instant of input sample ``first + i factor``.

        Raises
        ------
        ValueError
            If the input does not reach ``half`` samples beyond the first and the last row.
        """
        values = np.asarray(values, dtype=float)
        first = self.half if first is None else first
        rows = self.rows_of(len(values), first) if rows is None else rows
        last = first + (rows - 1) * self.factor
        if rows < 1 or first < self.half or last + self.half >= len(values):
            msg = (
                f"{rows} rows from sample {first} on need {self.half} samples of run-in and run-out; "
                f"the input has {len(values)} samples"
            )
            raise ValueError(msg)
        table = values.reshape(len(values), -1)
        out = np.empty((rows, table.shape[1]))
        for column in range(table.shape[1]):
            out[:, column] = self._column(np.ascontiguousarray(table[:, column]), first, rows)
        return out.reshape(rows, *values.shape[1:])

    def _column(self, values: np.ndarray, first: int, rows: int) -> np.ndarray:
        """One contiguous column: a sum of products for each output row, without BLAS."""
        start, stop = first - self.half, first + (rows - 1) * self.factor + self.half + 1
        windows = np.lib.stride_tricks.sliding_window_view(values[start:stop], len(self.taps))
        return np.einsum("nk,k->n", windows[:: self.factor], self.taps)


def gauss_markov(
    rng: np.random.Generator, shape: tuple[int, ...], sigma: float, correlation_s: float, rate_hz: float
) -> np.ndarray:
    """First-order Gauss-Markov process, discretized exactly and begun in its stationary state.

    Parameters
    ----------
    rng : numpy.random.Generator
    shape : tuple of int
        Time along the first axis.
    sigma : float
        Standard deviation at every instant.
    correlation_s : float [s]
        Autocorrelation is ``sigma^2 exp(-|t| / correlation_s)``.
    rate_hz : float [Hz]

    Returns
    -------
    shape
    """
    step = 1.0 / (rate_hz * correlation_s)
    drive = rng.standard_normal(shape) * (sigma * math.sqrt(-math.expm1(-2.0 * step)))
    drive[0] /= math.sqrt(-math.expm1(-2.0 * step))
    return signal.lfilter([1.0], [1.0, -math.exp(-step)], drive, axis=0)


POINTS = 16
"""Samples that ``between`` takes for each value."""


def between(values: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Values between evenly spaced samples: the polynomial through the 16 samples around each place.

    Parameters
    ----------
    values : (n,) or (n, c)
    position : (m,)
        In samples, from 7 to n - 8.

    Returns
    -------
    (m,) or (m, c)
        Polynomials of degree 15 are exact; halfway between samples, a sine of a tenth of the sample rate is exact to
        1e-7 and one of a quarter to 0.3 %.

    Raises
    ------
    ValueError
        If a place has no 8 samples on both sides.
    """
    values, position = np.asarray(values, dtype=float), np.asarray(position, dtype=float)
    below = POINTS // 2 - 1
    last = len(values) - 1 - POINTS // 2
    if len(position) and (position.min() < below or position.max() > last + 1):
        msg = f"places {position.min():g} to {position.max():g} need {POINTS // 2} of {len(values)} samples around each"
        raise ValueError(msg)
    # The very last place that is allowed is reached from the sample before it.
    whole = np.minimum(np.floor(position).astype(int), last)
    nodes = np.arange(-below, POINTS - below)
    away = (position - whole)[:, None] - nodes
    weights = np.ones_like(away)
    for j in range(POINTS):
        for i in range(POINTS):
            if i != j:
                weights[:, j] *= away[:, i] / (j - i)
    return np.einsum("mk,mk...->m...", weights, values[whole[:, None] + nodes])


def window_mean(values: np.ndarray, start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """Mean of a signal over windows of time, from its means over the steps around the samples.

    Windows that end between two steps are exact for a constant and for whole steps; what is between follows
    ``between``.

    Parameters
    ----------
    values : (n,) or (n, c)
    start, stop : (m,)
        Begin and end of each window in samples; sample ``k`` covers ``k - 1/2`` to ``k + 1/2``.

    Returns
    -------
    (m,) or (m, c)

    Raises
    ------
    ValueError
        If a window comes closer than 8 samples to an end.
    """
    values = np.asarray(values, dtype=float)
    middle = values.mean(axis=0)
    # Entry j is the integral up to the edge at j - 1/2; without the mean it stays small.
    integral = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values - middle, axis=0)])
    start, stop = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    gained = between(integral, stop + 0.5) - between(integral, start + 0.5)
    return middle + (gained.T / (stop - start)).T


def first_order_lag(values: np.ndarray, time_constant_s: float, rate_hz: float) -> np.ndarray:
    """What an instrument of first order makes of its input, ``T dy/dt = x - y``, at rest before the first sample.

    Parameters
    ----------
    values : (n, ...)
        Straight between its samples: for such an input the steps are exact.
    time_constant_s : float [s]
        0 changes nothing.
    rate_hz : float [Hz]

    Returns
    -------
    (n, ...)
    """
    values = np.asarray(values, dtype=float)
    if time_constant_s == 0.0:
        return values
    step = 1.0 / (rate_hz * time_constant_s)
    keep, mean = math.exp(-step), -math.expm1(-step) / step
    # The first sample is taken out so that rest is zero.
    moved = values - values[:1]
    return values[:1] + signal.lfilter([1.0 - mean, mean - keep], [1.0, -keep], moved, axis=0)
