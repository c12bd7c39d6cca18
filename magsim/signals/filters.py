"""Zero-phase filters: the compensation band, what is slower, and the high-pass of paper 002."""

from functools import lru_cache

import numpy as np
from scipy import signal

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

SLOW_HZ = (0.005, BAND_HZ[0])
"""Edges of what is slower than that band and not yet an offset [Hz]; amplitude gain 0.5 there."""

SLOW_ORDER = 2
"""Of its prototype: steeper ones ring for longer than a flight."""

SLOW_SHORTEST_S = 150.0
"""Shortest signal that has such a part [s]."""


@lru_cache(maxsize=32)
def _butter(
    edges_hz: tuple[float, ...], kind: str, rate_hz: float, order: int = ORDER
) -> tuple[np.ndarray, np.ndarray]:
    """Return second-order sections, (k, 6), and their states for a constant input of 1, (k, 2)."""
    edges = edges_hz[0] if len(edges_hz) == 1 else edges_hz
    sos = signal.butter(order, edges, kind, fs=rate_hz, output="sos")
    return sos, signal.sosfilt_zi(sos)


def _forward_backward(
    values: np.ndarray, edges_hz: tuple[float, ...], kind: str, rate_hz: float, order: int = ORDER
) -> np.ndarray:
    """Filter along the first axis in both directions, each begun in the steady state of its first sample.

    The same as ``scipy.signal.sosfiltfilt`` to the last bit, but channels are filtered in contiguous memory and the
    steady state is computed once for each filter.
    """
    values = np.asarray(values, dtype=float)
    sos, steady = _butter(edges_hz, kind, float(rate_hz), order)
    # scipy's default length of the odd extension at the ends, cut where the signal is shorter than it
    pad = min(3 * (2 * len(sos) + 1), len(values) - 1)
    table = values.reshape(len(values), -1)
    out = np.empty((table.shape[1], len(values) + 2 * pad))
    inside = slice(pad, pad + len(values))
    out[:, inside] = table.T
    out[:, :pad] = 2.0 * out[:, pad : pad + 1] - out[:, 2 * pad : pad : -1]
    last = inside.stop - 1
    out[:, inside.stop :] = 2.0 * out[:, last : last + 1] - out[:, last - 1 : last - pad - 1 : -1]
    for _ in range(2):
        out, _ = signal.sosfilt(sos, out, axis=1, zi=steady[:, None] * out[:, :1])
        out = out[:, ::-1]
    return out[:, inside].T.reshape(values.shape)


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


def slow_part(values: np.ndarray, rate_hz: float) -> np.ndarray:
    """Butterworth band-pass of order 2 from 0.005 to 0.1 Hz, forward and backward, after a straight line is taken out.

    The line keeps an offset and a trend from ringing at the ends, and neither is part of what returns. The first and
    the last 30 s (``EDGE_S``) are for the caller to drop. Of the rest, the standard deviation of sines from 0.01 to
    0.05 Hz of any phase is within 6 % of theirs, even where the signal lasts 150 s; of one at 0.005 Hz, whose period is
    200 s, it is 0.34 to 0.47 of it in 150 s and 0.46 to 0.48 in 600 s, where 0.5 is right.

    Parameters
    ----------
    values : (n,)
        Without gaps.
    rate_hz : float [Hz]

    Returns
    -------
    (n,)
        NaN where the signal lasts less than 150 s.
    """
    if (len(values) - 1) / rate_hz < SLOW_SHORTEST_S - 1e-6:
        return np.full(len(values), np.nan)
    return _forward_backward(signal.detrend(values), SLOW_HZ, "bandpass", rate_hz, SLOW_ORDER)
