"""Pieces of a time axis: rows without a gap, which may be filtered as one."""

import itertools

import numpy as np

from magsim.signals.filters import EDGE_S, band_pass


def median_step(time_s: np.ndarray) -> float:
    """Return the median step of a time axis [s]: ``numpy.median``, without what that does for other arrays.

    Parameters
    ----------
    time_s : (n,) [s]
        At least 2 finite rows.
    """
    steps = np.diff(time_s)
    middle = len(steps) // 2
    if len(steps) % 2:
        return float(np.partition(steps, middle)[middle])
    low, high = np.partition(steps, (middle - 1, middle))[middle - 1 : middle + 1]
    return float(0.5 * (low + high))


def spans(time_s: np.ndarray) -> list[slice]:
    """Split a time axis where it jumps by more than 1.5 median steps.

    Parameters
    ----------
    time_s : (n,) [s]
        Strictly increasing, at least 2 rows.

    Returns
    -------
    list of slice
        In order; together they cover all rows.
    """
    steps = np.diff(time_s)
    if steps.max() <= 1.5 * steps.min():  # the median lies between: no gap, without looking for it
        return [slice(0, len(time_s))]
    cuts = np.flatnonzero(steps > 1.5 * median_step(time_s)) + 1
    bounds = [0, *cuts.tolist(), len(time_s)]
    return [slice(a, b) for a, b in itertools.pairwise(bounds)]


def off_ends(time_s: np.ndarray, edge_s: float = EDGE_S) -> np.ndarray:
    """Mark the rows of a piece that are far enough from its ends for a forward-backward filter.

    Parameters
    ----------
    time_s : (n,) [s]
        Strictly increasing. What was filtered as one piece must be cropped as one piece.
    edge_s : float [s]
        Time that is left out at each end.

    Returns
    -------
    (n,) bool
    """
    time_s = np.asarray(time_s, dtype=float)
    return (time_s >= time_s[0] + edge_s - 1e-9) & (time_s <= time_s[-1] - edge_s + 1e-9)


def in_band(values: np.ndarray, time_s: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Band-pass each piece by itself and drop its ends.

    Parameters
    ----------
    values : (n, ...)
    time_s : (n,) [s]
    rows : (n,) bool, optional
        Rows to return; all rows of a piece are filtered together. By default all.

    Returns
    -------
    (m, ...)
        Pieces that are shorter than both ends together give no rows.
    """
    rate_hz = 1.0 / median_step(time_s)
    kept = in_band_rows(time_s, rows)
    parts = [
        np.ascontiguousarray(band_pass(values[span], rate_hz)[_as_slice(kept[span])])
        for span in spans(time_s)
        if kept[span].any()
    ]
    return parts[0] if len(parts) == 1 else np.concatenate([values[:0], *parts])


def in_band_rows(time_s: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Mark the rows that ``in_band`` returns, (n,) bool."""
    kept = np.concatenate([off_ends(time_s[span]) for span in spans(time_s)])
    return kept if rows is None else kept & rows


def _as_slice(rows: np.ndarray) -> np.ndarray | slice:
    """Return a mask as a slice where its rows touch: a slice is copied faster."""
    marked = np.flatnonzero(rows)
    first, stop = int(marked[0]), int(marked[-1]) + 1
    return slice(first, stop) if stop - first == len(marked) else rows
