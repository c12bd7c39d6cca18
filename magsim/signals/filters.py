"""Zero-phase filters: the compensation band, and the high-pass of paper 002."""

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


@lru_cache(maxsize=32)
def _butter(edges_hz: tuple[float, ...], kind: str, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Return second-order sections, (k, 6), and their states for a constant input of 1, (k, 2)."""
    edges = edges_hz[0] if len(edges_hz) == 1 else edges_hz
    sos = signal.butter(ORDER, edges, kind, fs=rate_hz, output="sos")
    return sos, signal.sosfilt_zi(sos)


def _forward_backward(values: np.ndarray, edges_hz: tuple[float, ...], kind: str, rate_hz: float) -> np.ndarray:
    """Filter along the first axis in both directions, each begun in the steady state of its first sample.

    The same as ``scipy.signal.sosfiltfilt`` to the last bit, but channels are filtered in contiguous memory and the
    steady state is computed once for each filter.
    """
    values = np.asarray(values, dtype=float)
    sos, steady = _butter(edges_hz, kind, float(rate_hz))
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
