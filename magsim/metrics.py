"""Scores as pure functions of arrays.

Symbols: ``reading`` is what the scalar magnetometer says, ``clean`` the field without the aircraft, ``interference``
their difference I, ``error`` what a compensator leaves of it, e = I - estimate; all (n,) [nT]. Band-passed is
``magsim.signals.band_pass``. A score must be told with its variant: the literature has several of the same name.
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from magsim import signals


def std(values: np.ndarray) -> float:
    """Standard deviation: root of the mean squared departure from the mean (division by n)."""
    values = np.asarray(values, dtype=float)
    return float(np.sqrt(np.mean((values - values.mean()) ** 2)))


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(np.asarray(values, dtype=float)))))


def rmse(error: np.ndarray) -> float:
    """Root of the mean squared error [nT]: broadband, with offset."""
    return rms(error)


def rmse_0(error: np.ndarray) -> float:
    """Standard deviation of the error [nT]: broadband, mean removed."""
    return std(error)


def crop(time_s: np.ndarray, edge_s: float = signals.EDGE_S) -> np.ndarray:
    """Rows that are far enough from the ends for a forward-backward filter.

    Parameters
    ----------
    time_s : (n,) [s]
        Strictly increasing. What was filtered as one piece must be cropped as one piece.
    edge_s : float [s]

    Returns
    -------
    (n,) bool
    """
    time_s = np.asarray(time_s, dtype=float)
    return (time_s >= time_s[0] + edge_s - 1e-9) & (time_s <= time_s[-1] - edge_s + 1e-9)


def band_std(values: np.ndarray, rate_hz: float, mask: np.ndarray | None = None) -> float:
    """STD in the band 0.1 to 0.6 Hz [nT].

    Parameters
    ----------
    values : (n,) [nT]
        Filtered whole.
    rate_hz : float [Hz]
    mask : (n,) bool, optional
        Rows that count; by default those that ``crop`` leaves.

    Raises
    ------
    ValueError
        If no row counts.
    """
    return std(_kept(signals.band_pass(values, rate_hz), rate_hz, mask))


def improvement_ratio(
    interference: np.ndarray, error: np.ndarray, rate_hz: float, mask: np.ndarray | None = None
) -> float:
    """IR against truth: STD of the band-passed interference over STD of the band-passed error.

    Truth form of paper 000, eq. 41. Infinite where the error is zero.

    Parameters
    ----------
    interference, error : (n,) [nT]
    rate_hz : float [Hz]
    mask : (n,) bool, optional
        Rows that count; by default those that ``crop`` leaves.
    """
    return ratio(band_std(interference, rate_hz, mask), band_std(error, rate_hz, mask))


def ir_paper(reading: np.ndarray, compensated: np.ndarray, rate_hz: float, mask: np.ndarray | None = None) -> float:
    """IR as papers 000 and 001 print it: STD of the band-passed reading over that of the compensated reading.

    Rewards any smooth output: for comparison with papers only.

    Parameters
    ----------
    reading, compensated : (n,) [nT]
    rate_hz : float [Hz]
    mask : (n,) bool, optional
        Rows that count; by default those that ``crop`` leaves.
    """
    return ratio(band_std(reading, rate_hz, mask), band_std(compensated, rate_hz, mask))


def ir_003(reading: np.ndarray, compensated: np.ndarray, rate_hz: float, mask: np.ndarray | None = None) -> float:
    """IR after a high-pass at 0.03 Hz, as paper 002, eq. 22 prints it.

    Parameters
    ----------
    reading, compensated : (n,) [nT]
    rate_hz : float [Hz]
    mask : (n,) bool, optional
        Rows that count; by default those that ``crop`` leaves with ``signals.HIGH_PASS_EDGE_S``.
    """
    before, after = (
        std(_kept(signals.high_pass(values, rate_hz), rate_hz, mask, signals.HIGH_PASS_EDGE_S))
        for values in (reading, compensated)
    )
    return ratio(before, after)


class Cell(NamedTuple):
    """One heading and maneuver of a figure-of-merit flight."""

    heading: Hashable
    maneuver: Hashable


def fom_cells(
    band_passed: np.ndarray,
    heading: np.ndarray,
    maneuver: np.ndarray,
    mask: np.ndarray | None = None,
) -> dict[Cell, float]:
    """Peak to peak of each maneuver's signature: maximum minus minimum [nT].

    Parameters
    ----------
    band_passed : (n,) [nT]
        Band-passed error.
    heading : (n,)
        Label of the heading of each row: the planned course or a number.
    maneuver : (n,)
        Label of the maneuver, 0 where there is none.
    mask : (n,) bool, optional
        Rows that count.

    Returns
    -------
    dict
        In order of heading, then maneuver; only cells that have rows.
    """
    return {cell: float(np.ptp(band_passed[rows])) for cell, rows in _cells(heading, maneuver, mask)}


def fom_mean_cells(
    band_passed: np.ndarray,
    heading: np.ndarray,
    maneuver: np.ndarray,
    cycle: np.ndarray,
    mask: np.ndarray | None = None,
) -> dict[Cell, float]:
    """Mean over a maneuver's oscillations of the peak to peak of each one [nT].

    Parameters
    ----------
    band_passed, heading, maneuver, mask
        As in ``fom_cells``.
    cycle : (n,)
        Number of the oscillation within its maneuver. Cycles of one number in several passes on the same heading
        count as one.

    Returns
    -------
    dict
        In order of heading, then maneuver; only cells that have rows.
    """
    out = {}
    for cell, rows in _cells(heading, maneuver, mask):
        peaks = [np.ptp(band_passed[rows & (cycle == number)]) for number in np.unique(cycle[rows])]
        out[cell] = float(np.mean(peaks))
    return out


def fom(cells: Mapping[Cell, float] | Sequence[float]) -> float:
    """Figure of merit [nT]: the sum of the peak-to-peak values of 4 headings x 3 maneuvers.

    From ``fom_cells`` it is the FOM of the SEG (maximum minus minimum of the whole signature); from
    ``fom_mean_cells`` the variant of the mean oscillation, which is never larger. NaN without any cell.
    """
    values = list(cells.values()) if isinstance(cells, Mapping) else list(cells)
    return float(sum(values)) if values else float("nan")


def heading_shift(error: np.ndarray, heading: np.ndarray, mask: np.ndarray | None = None) -> float:
    """Heading shift [nT]: largest minus smallest mean error over the headings.

    Parameters
    ----------
    error : (n,) [nT]
        Broadband.
    heading : (n,)
        Label of the heading of each row.
    mask : (n,) bool, optional
        Rows that count: the straight legs.
    """
    keep = np.ones(len(error), dtype=bool) if mask is None else np.asarray(mask, dtype=bool)
    means = [np.mean(error[keep & (heading == value)]) for value in np.unique(heading[keep])]
    return float(np.ptp(means)) if means else float("nan")


def _cells(heading: np.ndarray, maneuver: np.ndarray, mask: np.ndarray | None) -> list[tuple[Cell, np.ndarray]]:
    keep = maneuver != 0
    if mask is not None:
        keep = keep & np.asarray(mask, dtype=bool)
    pairs = sorted(set(zip(heading[keep].tolist(), maneuver[keep].tolist(), strict=True)))
    return [(Cell(*pair), keep & (heading == pair[0]) & (maneuver == pair[1])) for pair in pairs]


def _kept(filtered: np.ndarray, rate_hz: float, mask: np.ndarray | None, edge_s: float = signals.EDGE_S) -> np.ndarray:
    if mask is None:
        mask = crop(np.arange(len(filtered)) / rate_hz, edge_s)
    kept = filtered[np.asarray(mask, dtype=bool)]
    if not len(kept):
        msg = f"no row of {len(filtered)} is left to score: flights must be longer than {2 * edge_s:g} s"
        raise ValueError(msg)
    return kept


def ratio(before: float, after: float) -> float:
    """Improvement from a spread before to one after: infinite where nothing is left, NaN where nothing was."""
    if after == 0.0:
        return float("inf") if before > 0.0 else float("nan")
    return before / after
