"""Currents, voltages and deflections as methods read them: which are alive, and where their zero lies.

The zero of a current sensor is another one after every start: 0.05 A, which on a wire of 3 nT/A is as much as all that
a good compensation leaves. Where a load has been off, its sensor tells its own zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.background.rows import ChannelRows
from magsim.compensation.columns.base import require
from magsim.errors import DataError
from magsim.recording import Recording
from magsim.signals import spans

KINDS: dict[str, columns.Family] = {
    "currents": columns.CURRENT,
    "voltages": columns.VOLTAGE,
    "surfaces": columns.SURFACE,
    "accelerations": columns.INS_ACCELERATION,
}
"""Kinds of channels by name."""

ZERO_A = 0.2
"""How far a current's mean may be from its rest and still be its zero [A]: more than zeros spread, less than a load."""

MEAN_S = 10.0
"""Time that the mean is taken over: some flashes of a strobe light [s]."""

_REST_SHARE = 0.05
"""Least share of a flight in which a load must rest for its zero to be told."""

_ALIVE = 3.0
"""A channel is alive if it varies by so many times its noise."""

_TWO_LEVELS = 5.0
"""What flashes has no quiet rows to tell its noise, but a range of few deviations; that of noise is 6 and more."""


@dataclass(frozen=True)
class Channel:
    """One channel.

    Attributes
    ----------
    name : str
        Column of the recording.
    rest : float, optional
        Its mean reading over the training flights while its load is off, or if its load never changes; else None.
    """

    name: str
    rest: float | None = None

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the channel, (n,), its zero corrected by what a piece has shown of its rest up to each row.

        Raises
        ------
        RequestError
            If the recording lacks it.
        DataError
            If a value is not finite.
        """
        require(recording, [self.name])
        values = recording[self.name]
        bad = ~np.isfinite(values)
        if bad.any():
            msg = f"recording {recording.name!r}: {self.name} is not finite at {recording.time_s[np.argmax(bad)]:g} s"
            raise DataError(msg)
        if self.rest is None:
            return values
        out = np.empty_like(values)
        rows = _mean_rows(recording)
        for span in spans(recording.time_s):
            above = trailing_mean(values[span], rows) - self.rest
            resting = np.abs(above) < ZERO_A
            resting[: rows - 1] = False
            zero = np.cumsum(np.where(resting, above, 0.0)) / np.maximum(np.cumsum(resting), 1)
            out[span] = values[span] - zero
        return out

    def rows(self, rate_hz: float) -> ChannelRows:
        """Return the channel row by row."""
        return ChannelRows(self.name, self.rest, max(round(MEAN_S * rate_hz), 1), ZERO_A)


def trailing_mean(values: np.ndarray, rows: int) -> np.ndarray:
    """Return the mean of each row and of those before it, as many as there are up to a number, (n,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    first = np.maximum(np.arange(1, len(values) + 1) - rows, 0)
    last = np.arange(1, len(values) + 1)
    return (total[last] - total[first]) / (last - first)


def _mean_rows(recording: Recording) -> int:
    return max(round(MEAN_S * recording.rate_hz), 1)


def live_channels(recordings: Sequence[Recording], kinds: Sequence[str]) -> tuple[Channel, ...]:
    """Return the channels of some kinds that all recordings have and that vary by more than their noise in one.

    Parameters
    ----------
    recordings : sequence of Recording
    kinds : sequence of str
        Of ``KINDS``.
    """
    found = []
    for kind in kinds:
        family = KINDS[kind]
        for name in recordings[0].data:
            if family.match(name) and all(name in recording for recording in recordings):
                series = [recording[name] for recording in recordings]
                if any(is_live(values) for values in series):
                    found.append(Channel(name, _rest(name, recordings) if kind == "currents" else None))
    return tuple(found)


def of_kinds(channels: Sequence[Channel], kinds: Sequence[str]) -> tuple[Channel, ...]:
    """Return those of some kinds, in the order of the kinds."""
    return tuple(channel for kind in kinds for channel in channels if KINDS[kind].match(channel.name))


def is_live(values: np.ndarray) -> bool:
    """Whether a channel varies by more than its noise."""
    spread = float(np.std(values))
    if len(values) < 4 or spread <= 1e-9 * float(np.abs(values).max()):
        return False
    return spread > _ALIVE * noise_of(values) or float(np.ptp(values)) < _TWO_LEVELS * spread


def noise_of(values: np.ndarray) -> float:
    """Return the deviation of white noise in a series from its third differences, which steps and drifts hardly touch.

    The median of the absolute value of Gaussian noise is 0.6745 deviations; third differences have 20 times the
    variance.
    """
    return float(np.median(np.abs(np.diff(values, 3)))) / 0.6745 / np.sqrt(20.0)


def _rest(name: str, recordings: Sequence[Recording]) -> float | None:
    """Return the mean reading of a load that rests in every flight: it is off for a while, or never changes."""
    rests = []
    for recording in recordings:
        rows = _mean_rows(recording)
        parts = [trailing_mean(recording[name][span], rows)[rows - 1 :] for span in spans(recording.time_s)]
        means = np.concatenate(parts)
        if len(means) < rows:
            return None
        low = float(np.quantile(means, _REST_SHARE / 2.0))
        near = np.abs(means - low) < ZERO_A
        rest = float(means[near].mean())
        off = near.mean() >= _REST_SHARE and abs(rest) < ZERO_A
        if not (off or near.all()):
            return None
        rests.append(rest)
    mean = float(np.mean(rests))
    return mean if max(abs(rest - mean) for rest in rests) < ZERO_A else None
