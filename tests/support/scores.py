"""Scores computed by hand, from the definitions: what the benchmark's metrics are compared with."""

import numpy as np

from magsim import signals


def off_ends(count: int, rate_hz: float, edge_s: float = signals.EDGE_S) -> slice:
    """Rows of a piece without what a forward-backward filter spoils at its ends."""
    edge = round(edge_s * rate_hz)
    return slice(edge, count - edge)


def band_std(values: np.ndarray, rate_hz: float) -> float:
    """STD in 0.1 to 0.6 Hz [nT], 30 s left out at both ends."""
    return float(np.std(signals.band_pass(values, rate_hz)[off_ends(len(values), rate_hz)]))


def improvement_ratio(interference: np.ndarray, error: np.ndarray, rate_hz: float) -> float:
    """In-band STD of the interference over that of the error."""
    return band_std(interference, rate_hz) / band_std(error, rate_hz)


def ir_003(reading: np.ndarray, compensated: np.ndarray, rate_hz: float, rows: np.ndarray | None = None) -> float:
    """STD of the reading over that of the compensated reading, both above 0.03 Hz, 60 s left out at both ends."""
    keep = np.zeros(len(reading), dtype=bool)
    keep[off_ends(len(reading), rate_hz, signals.HIGH_PASS_EDGE_S)] = True
    if rows is not None:
        keep &= rows
    before, after = (np.std(signals.high_pass(values, rate_hz)[keep]) for values in (reading, compensated))
    return float(before / after)


def rmse(error: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(error))))


def peaks(values: np.ndarray, heading: np.ndarray, maneuver: np.ndarray) -> list[float]:
    """Maximum minus minimum for each heading and maneuver that has rows."""
    found = []
    for course in np.unique(heading):
        for code in (1.0, 2.0, 3.0):
            rows = (heading == course) & (maneuver == code)
            if rows.any():
                found.append(float(np.ptp(values[rows])))
    return found
