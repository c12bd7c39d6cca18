"""Filters, derivatives, decimation and drift: pure functions of evenly sampled arrays.

Time runs along the first axis; further axes are columns. Sampling rates are in Hz.
"""

from magsim.signals.decimation import Decimator, run_in_s
from magsim.signals.derivatives import derivative, spline_derivative
from magsim.signals.filters import (
    BAND_HZ,
    EDGE_S,
    HIGH_PASS_EDGE_S,
    HIGH_PASS_HZ,
    SLOW_HZ,
    band_pass,
    high_pass,
    slow_part,
)
from magsim.signals.interpolation import POINTS, between, window_mean
from magsim.signals.pieces import in_band, in_band_rows, median_step, off_ends, spans
from magsim.signals.processes import first_order_lag, gauss_markov

__all__ = [
    "BAND_HZ",
    "EDGE_S",
    "HIGH_PASS_EDGE_S",
    "HIGH_PASS_HZ",
    "POINTS",
    "SLOW_HZ",
    "Decimator",
    "band_pass",
    "between",
    "derivative",
    "first_order_lag",
    "gauss_markov",
    "high_pass",
    "in_band",
    "in_band_rows",
    "median_step",
    "off_ends",
    "run_in_s",
    "slow_part",
    "spans",
    "spline_derivative",
    "window_mean",
]
