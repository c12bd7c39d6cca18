"""Means of ratios over sets of flights, with intervals: Student's t of their logarithms.

At twelve sets it covers what it says, where percentiles and accelerated bootstraps do not.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

COVERED = 0.95


class Mean(NamedTuple):
    """Geometric mean and its 95 % interval; the bounds are NaN where there are fewer than two values."""

    value: float
    low: float
    high: float

    @property
    def text(self) -> str:
        """The interval in words."""
        return f"95 % interval {self.low:.4g} .. {self.high:.4g}"


def geometric_mean(values: Sequence[float]) -> Mean:
    """Return the geometric mean of positive values, one of each set."""
    logs = np.log(np.asarray(values, dtype=float))
    middle, count = float(logs.mean()), len(logs)
    if count < 2:
        return Mean(float(np.exp(middle)), float("nan"), float("nan"))
    half = float(stats.t.ppf(0.5 + COVERED / 2.0, count - 1) * logs.std(ddof=1) / np.sqrt(count))
    return Mean(*(float(np.exp(middle + step)) for step in (0.0, -half, half)))
