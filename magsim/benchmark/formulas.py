"""Formulas of scores: pure functions of residuals and of signals."""

import numpy as np

from magsim.benchmark.residuals import Residuals
from magsim.benchmark.twins import PEAKS_NT


def std(values: np.ndarray) -> float:
    """Return the standard deviation: root of the mean squared departure from the mean (division by n)."""
    return float(np.sqrt(np.mean((values - values.mean()) ** 2)))


def rms(values: np.ndarray) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def ratio(before: float, after: float) -> float:
    """Return the improvement from a spread before to one after: infinite where none is left, NaN where none was."""
    if after == 0.0:
        return float("inf") if before > 0.0 else float("nan")
    return before / after


def figure_of_merit(residuals: Residuals, values: np.ndarray) -> float:
    """Return the sum of the peak-to-peak values of all maneuvers on all headings, usually 3 x 4 [nT].

    Maximum minus minimum of the whole signature of each maneuver, as the SEG defines the figure of merit.
    """
    return float(sum(float(np.ptp(values[cell.rows])) for cell in residuals.cells))


def gain_at(residuals: Residuals, height: int) -> float:
    """Return the share of injected anomalies of one height that is left: 1 where nothing is removed, NaN without any.

    Parameters
    ----------
    residuals : Residuals
    height : int
        Place in ``PEAKS_NT``.
    """
    injected, change = residuals.injected[:, height], residuals.change[:, height]
    power = float(np.sum(injected**2))
    return float(np.sum(change * injected)) / power if power > 0.0 else float("nan")


def anomaly_gain(residuals: Residuals) -> float:
    """Return the share that is left of anomalies of the height where it is farthest from 1; NaN without any."""
    every = [gain_at(residuals, number) for number in range(len(PEAKS_NT))]
    known = [gain for gain in every if not np.isnan(gain)]
    return max(known, key=lambda gain: abs(gain - 1.0)) if known else float("nan")


NEAR = 1e-3
"""Rows are near an anomaly where it is more than this share of its height in band."""


def distortion(residuals: Residuals) -> float:
    """Return how far the change departs from a copy of the anomaly, near anomalies and over them; the worst height."""
    found = []
    for number in range(len(PEAKS_NT)):
        injected, change = residuals.injected[:, number], residuals.change[:, number]
        gain = gain_at(residuals, number)
        if np.isnan(gain):
            continue
        near = np.abs(injected) > NEAR * np.abs(injected).max()
        found.append(rms(change[near] - gain * injected[near]) / rms(injected[near]))
    return max(found) if found else float("nan")


def excess_pt(residuals: Residuals) -> float:
    """Return the error in band beyond the instrument's, by the difference of variances [pT]; 0 where there is none."""
    left, floor = std(known(residuals.error)), std(known(residuals.floor))
    return 1000.0 * float(np.sqrt(max(left**2 - floor**2, 0.0)))


def heading_dc(residuals: Residuals) -> float:
    """Return the largest minus the smallest mean error on straight legs over the headings [nT]; NaN of one heading."""
    raw = known(residuals.error_raw)
    means = [raw[one.rows].mean() for one in residuals.segments if one.name.startswith("heading")]
    return float(np.ptp(means)) if len(means) > 1 else float("nan")


def slow_nt(residuals: Residuals) -> float:
    """Return the standard deviation of the slow error, over the rows that have it [nT]."""
    slow = known(residuals.slow)
    return std(slow[np.isfinite(slow)])


def r_squared(residuals: Residuals) -> float:
    """Return 1 minus the squared error over the squared departure of the interference from its mean (paper 001)."""
    interference = known(residuals.interference_raw)
    spread = float(np.sum((interference - interference.mean()) ** 2))
    return 1.0 - float(np.sum(known(residuals.error_raw) ** 2)) / spread if spread > 0.0 else float("nan")


def known(values: np.ndarray | None) -> np.ndarray:
    """Return a signal that must be there: ``Metric.needs`` has promised it."""
    assert values is not None
    return values
