"""Spectra of residuals by band, and their coherence with input channels, over rows without a gap."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import csd

from magsim import signals

BANDS_HZ = ((0.03, 0.1), (0.1, 0.2), (0.2, 0.35), (0.35, 0.6), (0.6, 1.0), (1.0, 2.0), (2.0, 5.0))
"""Bands of a table of spectra: three in the compensation band, those beside it, and up to half of 10 Hz."""

WINDOW_S, LONG_WINDOW_S = 25.6, 51.2
"""Windows of coherences (many of them) and of spectra (fine enough for 0.03 Hz)."""

CONFIDENCE = 0.95


class Spectrum(NamedTuple):
    """One-sided power density."""

    frequency_hz: np.ndarray
    density: np.ndarray
    """[unit^2/Hz]"""

    def std(self, low_hz: float, high_hz: float) -> float:
        """Return the deviation in a band."""
        rows = (self.frequency_hz >= low_hz) & (self.frequency_hz < high_hz)
        step = self.frequency_hz[1] - self.frequency_hz[0]
        return float(np.sqrt(np.sum(self.density[rows]) * step))


class Coherence(NamedTuple):
    """Coherence of a residual with a channel, in the compensation band."""

    channel: str
    peak: float
    """Largest squared coherence."""
    peak_hz: float
    mean: float
    level: float
    """Squared coherence that none of all channels would reach by chance (95 %)."""
    coherent_nt: float
    """Deviation of what of the residual in band follows the channel, less what chance would give [nT]."""

    @property
    def is_significant(self) -> bool:
        """Whether the largest is no chance."""
        return self.peak > self.level


class _Sums(NamedTuple):
    """Mean spectra over windows."""

    frequency_hz: np.ndarray
    first: np.ndarray
    second: np.ndarray
    cross: np.ndarray
    windows: float
    """Independent windows."""


def spectrum(values: np.ndarray, runs: Sequence[slice], rate_hz: float) -> Spectrum | None:
    """Return the power density over runs of rows; None where none is as long as a window.

    Parameters
    ----------
    values : (n,)
    runs : sequence of slice
        Rows without a gap.
    rate_hz : float [Hz]
    """
    for window_s in (LONG_WINDOW_S, WINDOW_S):
        sums = _sums(values, values, runs, rate_hz, window_s)
        if sums is not None:
            return Spectrum(sums.frequency_hz, sums.first)
    return None


def coherence_level(windows: float, chances: int) -> float:
    """Return the squared coherence that the largest of some independent ones exceeds by chance in 1 of 20 cases.

    Of one it is 1 - 0.05^(1 / (windows - 1)) (Amos and Koopmans, 1963; Thompson, J. Atmos. Sci. 1979, 36, 2020-2021).

    Parameters
    ----------
    windows : float
        Independent windows.
    chances : int
        Frequencies times channels.
    """
    if windows <= 1.0:
        return 1.0
    alone = 1.0 - CONFIDENCE ** (1.0 / chances)
    return float(1.0 - alone ** (1.0 / (windows - 1.0)))


def coherences(
    residual: np.ndarray, channels: dict[str, np.ndarray], runs: Sequence[slice], rate_hz: float
) -> tuple[Coherence, ...]:
    """Return the coherence of a residual with each channel in 0.1 to 0.6 Hz, the largest first.

    Parameters
    ----------
    residual : (n,) [nT]
    channels : dict of str to (n,)
        None of them constant.
    runs : sequence of slice
        Rows without a gap.
    rate_hz : float [Hz]

    Returns
    -------
    tuple of Coherence
        None where no run has two windows.
    """
    out = []
    for name, values in channels.items():
        sums = _sums(residual, values, runs, rate_hz, WINDOW_S)
        if sums is None or sums.windows < 2.0:
            return ()
        low, high = signals.BAND_HZ
        rows = (sums.frequency_hz >= low) & (sums.frequency_hz <= high)
        power = (sums.first * sums.second)[rows]
        squared = np.where(power > 0.0, np.abs(sums.cross[rows]) ** 2 / np.where(power > 0.0, power, 1.0), 0.0)
        best = int(np.argmax(squared))
        beyond = np.maximum(squared - 1.0 / sums.windows, 0.0)
        step = sums.frequency_hz[1] - sums.frequency_hz[0]
        coherent = float(np.sqrt(np.sum(beyond * sums.first[rows]) * step))
        level = coherence_level(sums.windows, len(channels) * int(rows.sum()))
        peak_hz = float(sums.frequency_hz[rows][best])
        out.append(Coherence(name, float(squared[best]), peak_hz, float(squared.mean()), level, coherent))
    return tuple(sorted(out, key=lambda one: -one.peak))


def _sums(
    first: np.ndarray, second: np.ndarray, runs: Sequence[slice], rate_hz: float, window_s: float
) -> _Sums | None:
    """Return spectra and cross-spectrum over half-overlapping Hann windows; None where no run has one."""
    size = round(window_s * rate_hz)
    totals: list[np.ndarray] = []
    count, frequency = 0, np.zeros(0)
    for run in runs:
        length = run.stop - run.start
        if length < size:
            continue
        number = 1 + (length - size) // (size - size // 2)
        pairs = ((first, first), (second, second), (first, second))
        found = [csd(a[run], b[run], rate_hz, nperseg=size, detrend="linear") for a, b in pairs]
        frequency = found[0][0]
        totals.append(number * np.array([density for _, density in found]))
        count += number
    if not count:
        return None
    mean = sum(totals[1:], totals[0]) / count
    # neighbors that overlap by half correlate by 1/6 (Welch, IEEE Trans. Audio 1967, 15, 70-73)
    return _Sums(frequency, mean[0].real, mean[1].real, mean[2], count / (1.0 + 2.0 / 36.0))
