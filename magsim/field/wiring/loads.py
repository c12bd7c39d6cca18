"""Currents over time: what is switched, pulsed or driven by the flight, exact in the mean over each sample.

A sample of a current is its mean over the step around the sample's time. A strobe's pulse of milliseconds then carries
its whole charge, wherever it falls between samples, and the mean over a flight is that of the pulses themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.signal import lfilter


@dataclass(frozen=True)
class Steps:
    """A level that changes at certain times, behind a first-order lag, with an inrush at each switch-on.

    The drive is ``u_j + v_j exp(-(t - t_j) / inrush_s)`` from ``t_j`` on, with ``v_j = (inrush - 1) (u_j - u_{j-1})``
    where the level rises and 0 where it falls. The current follows it with the time constant ``rise_s``.

    Attributes
    ----------
    times_s : (e,) [s]
        Increasing; the current has settled on the first level before the second time.
    levels_a : (e,) [A]
        From each time on.
    rise_s : float [s]
        0: it jumps.
    inrush : float
        Peak over the level at switch-on, 1 for none.
    inrush_s : float [s]
        How fast it decays; longer than ``rise_s``.
    """

    times_s: np.ndarray
    levels_a: np.ndarray
    rise_s: float = 0.0
    inrush: float = 1.0
    inrush_s: float = field(default=1.0)

    @cached_property
    def _extra(self) -> np.ndarray:
        """Amplitude of the decaying part of the current in each interval, (e,) [A]."""
        rises = np.maximum(0.0, np.diff(self.levels_a, prepend=self.levels_a[:1]))
        return (self.inrush - 1.0) * rises * self.inrush_s / (self.inrush_s - self.rise_s)

    @cached_property
    def _start(self) -> np.ndarray:
        """Current at the beginning of each interval less the part that is no transient of the lag, (e,) [A]."""
        transient = np.zeros(len(self.times_s))
        if self.rise_s == 0.0:
            return transient
        spans = np.diff(self.times_s)
        slow = self._extra[:-1] * np.exp(-spans / self.inrush_s)
        decay = np.exp(-spans / self.rise_s)
        jump = self.levels_a[:-1] + slow - self.levels_a[1:] - self._extra[1:]
        state = 0.0
        for j, (kept, step) in enumerate(zip(decay.tolist(), jump.tolist(), strict=True)):
            state = state * kept + step
            transient[j + 1] = state
        return transient

    def _within(self, index: np.ndarray, since: np.ndarray) -> np.ndarray:
        """Return the charge from the beginning of an interval, [A s]."""
        out = self.levels_a[index] * since
        if self.inrush != 1.0:
            out -= self._extra[index] * self.inrush_s * np.expm1(-since / self.inrush_s)
        if self.rise_s > 0.0:
            out -= self._start[index] * self.rise_s * np.expm1(-since / self.rise_s)
        return out

    @cached_property
    def _before(self) -> np.ndarray:
        """Charge until the beginning of each interval, (e,) [A s]."""
        spans = np.diff(self.times_s)
        return np.concatenate([[0.0], np.cumsum(self._within(np.arange(len(spans)), spans))])

    def charge(self, time_s: np.ndarray) -> np.ndarray:
        """Return the charge from the first time on, (n,) [A s], at increasing times not before it."""
        first = np.searchsorted(time_s, self.times_s)
        index = np.repeat(np.arange(len(first)), np.diff(first, append=len(time_s)))
        return self._before[index] + self._within(index, time_s - self.times_s[index])

    def mean(self, time_s: np.ndarray, step_s: float) -> np.ndarray:
        """Return the mean current over the step around each of evenly spaced times, (n,) [A]."""
        edges = np.append(time_s - 0.5 * step_s, time_s[-1] + 0.5 * step_s)
        return np.diff(self.charge(edges)) / step_s


def lagged(values: np.ndarray, rise_s: float, step_s: float) -> np.ndarray:
    """Apply a first-order lag to evenly spaced samples, exact for straight lines between them; begins settled.

    Parameters
    ----------
    values : (n,)
    rise_s : float [s]
        Time constant; 0 for none.
    step_s : float [s]

    Returns
    -------
    (n,)
    """
    if rise_s == 0.0:
        return values
    decay = np.exp(-step_s / rise_s)
    mean = rise_s / step_s * -np.expm1(-step_s / rise_s)
    now, before = 1.0 - mean, mean - decay
    out, _ = lfilter([now, before], [1.0, -decay], values, zi=[values[0] * (1.0 - now)])
    return out


def pulses(start_s: float, stop_s: float, period_s: float, width_s: float, phase_s: float) -> np.ndarray:
    """Return alternating starts and ends of pulses, (2 k,) [s], from one period before ``start_s`` to ``stop_s``."""
    first = np.floor((start_s - phase_s) / period_s) - 1.0
    count = int(np.ceil((stop_s - phase_s) / period_s) - first) + 1
    begin = phase_s + period_s * (first + np.arange(count))
    return np.column_stack([begin, begin + width_s]).ravel()


def cycles(
    rng: np.random.Generator, start_s: float, stop_s: float, *, on_s: float, off_s: float, jitter: float
) -> np.ndarray:
    """Return alternating times of switching on and off, (2 k,) [s], of a load whose cycles vary.

    The first cycle began at a random time of its own before ``start_s``; each span is drawn evenly from ``1 - jitter``
    to ``1 + jitter`` times its length. A longer flight goes on where a shorter one ends.
    """
    begin = start_s - rng.uniform() * (on_s + off_s)
    count = int(np.ceil((stop_s - begin) / ((1.0 - jitter) * (on_s + off_s)))) + 1
    spans = np.array([on_s, off_s]) * rng.uniform(1.0 - jitter, 1.0 + jitter, (count, 2))
    return np.concatenate([[begin], begin + np.cumsum(spans.ravel())[:-1]])


def longest_cycle(spans_s: Sequence[tuple[float, float]], times: int) -> float:
    """Return the longest cycle of which so many fit into some spans [s]: each span holds whole cycles alone."""
    lengths = np.array([stop - start for start, stop in spans_s])
    fits = (lengths[:, None] / np.arange(1, times + 1)).ravel()
    return float(max(cycle for cycle in fits if np.sum(np.floor(lengths / cycle + 1e-9)) >= times))


def shortened(on_s: float, off_s: float, longest_s: float) -> tuple[float, float]:
    """Return spans on and off that together are no longer than a cycle [s]; the pause is shortened first, to half."""
    if on_s + off_s <= longest_s:
        return on_s, off_s
    on_s = min(on_s, 0.5 * longest_s)
    return on_s, longest_s - on_s


def switched(time_s: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times (e,) [s] at which a logged switch changes, half way between rows, and states (e,) of 0 and 1.

    Parameters
    ----------
    time_s, state : (n,)
        On where the state is 0.5 or more.
    """
    on = (np.asarray(state) >= 0.5).astype(float)
    change = np.flatnonzero(np.diff(on))
    times = 0.5 * (time_s[change] + time_s[change + 1])
    return np.append(time_s[0], times), np.append(on[0], on[change + 1])
