"""From numbers between 0 and 1 to values of a key: the inverse of each distribution function."""

import math
from collections.abc import Sequence
from datetime import datetime, timedelta

import numpy as np
from scipy.special import ndtr, ndtri

from magsim.sweep.settings import Axis


def values(axis: Axis, numbers: np.ndarray) -> Sequence[object]:
    """Return the values of an axis that is drawn, (n,), plain numbers, dates or whatever its choice holds.

    Parameters
    ----------
    axis : Axis
    numbers : (n,)
        Above 0 and below 1.
    """
    if axis.choice is not None:
        chosen = np.minimum((numbers * len(axis.choice)).astype(int), len(axis.choice) - 1)
        return [axis.choice[i] for i in chosen]
    low, high = axis.uniform or (None, None)
    if isinstance(low, datetime) and isinstance(high, datetime):
        span_s = (high - low).total_seconds()
        return [low + timedelta(seconds=int(span_s * number)) for number in numbers]
    drawn = _real(axis, numbers)
    if not axis.whole:
        return drawn.tolist()
    return np.floor(drawn).astype(np.int64).tolist()


def _real(axis: Axis, numbers: np.ndarray) -> np.ndarray:
    """Return real numbers; of a whole axis those whose floor is wanted."""
    if axis.normal is not None:
        mean, std = axis.normal
        low, high = axis.limits or (-math.inf, math.inf)
        shift = 0.5 if axis.whole else 0.0
        below, above = ndtr((np.array([low - shift, high + shift]) - mean) / std)
        drawn = mean + std * ndtri(below + numbers * (above - below)) + shift
        return np.clip(drawn, low, high + (1.0 - 1e-9 if axis.whole else 0.0))
    pair = axis.uniform or axis.log_uniform
    assert pair is not None
    low, high = (float(bound) for bound in pair)  # type: ignore[arg-type]
    if axis.whole:
        high += 1.0
    if axis.log_uniform is not None:
        drawn = np.exp(math.log(low) + numbers * (math.log(high) - math.log(low)))
    else:
        drawn = low + numbers * (high - low)
    return np.clip(drawn, low, np.nextafter(high, low) if axis.whole else high)
