"""The angle of a sine train over time, with cycles of one size or with cycles that scatter.

Between two cycles of different amplitude and period both change by a step of fifth order over the phase, from a quarter
cycle before the joint to a quarter cycle after it. So angle, rate and acceleration have no step, and both peaks of a
cycle have its own amplitude. The time over the phase is known in closed form; it is inverted by Newton's method.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

QUARTER = 0.5 * math.pi
NEWTON_RAD = 1e-10
"""Newton's steps to the phase at a time end below this."""

CUT = 2.0
CUT_STD = math.sqrt(
    1.0
    - 2.0 * CUT * math.exp(-0.5 * CUT**2) / math.sqrt(2.0 * math.pi)
    + (CUT**2 - 1.0) * math.erfc(CUT / math.sqrt(2.0))
)
"""A standard normal number is moved to +-CUT where it lies beyond; its standard deviation then."""

FURTHEST = CUT / CUT_STD
"""Largest departure of a cycle from the mean, in standard deviations."""


class Cycle(NamedTuple):
    """One cycle of a sine train."""

    amplitude_deg: float
    period_s: float


@dataclass(frozen=True)
class TrainCurve:
    """Angle of a train on its own clock, which counts from the beginning of the first cycle.

    Attributes
    ----------
    cycles : sequence of Cycle
        At least one.
    ease_in_s, ease_out_s : float
        Time in which the sine rises before the first cycle, and falls after the last.
    """

    cycles: Sequence[Cycle]
    ease_in_s: float
    ease_out_s: float

    @cached_property
    def _even(self) -> float | None:
        """Angular frequency [rad/s] where all cycles are the same, else None."""
        return 2.0 * math.pi / self.cycles[0].period_s if len(set(self.cycles)) == 1 else None

    @cached_property
    def stop_s(self) -> float:
        """End of the last cycle [s]."""
        return math.fsum(cycle.period_s for cycle in self.cycles)

    @cached_property
    def starts_s(self) -> tuple[float, ...]:
        """Beginning of each cycle, and the end of the last one: where the sine passes zero upward [s]."""
        return tuple(self._time(2.0 * math.pi * i) for i in range(len(self.cycles) + 1))

    def at(self, time_s: float) -> tuple[float, float]:
        """Return angle [deg] and rate [deg/s] at a time."""
        rise, rising = _eased(time_s + self.ease_in_s, self.ease_in_s)
        fall, falling = _eased(self.stop_s + self.ease_out_s - time_s, self.ease_out_s)
        if rise == 0.0 or fall == 0.0:
            return 0.0, 0.0
        envelope, growing = rise * fall, rising * fall - rise * falling
        if self._even is None:
            phase, pace = self._phase(time_s)
            amplitude, slope = self._blend(phase, 0)
        else:
            phase, pace = self._even * time_s, self._even
            amplitude, slope = self.cycles[0].amplitude_deg, 0.0
        sin, cos = math.sin(phase), math.cos(phase)
        rate = (slope * sin + amplitude * cos) * pace * envelope + amplitude * sin * growing
        return amplitude * sin * envelope, rate

    def _phase(self, time_s: float) -> tuple[float, float]:
        """Return phase [rad] and its rate [rad/s] at a time."""
        phase = 2.0 * math.pi * len(self.cycles) * time_s / self.stop_s
        while True:
            pace = 2.0 * math.pi / self._blend(phase, 1)[0]
            step = (time_s - self._time(phase)) * pace
            phase += step
            if abs(step) < NEWTON_RAD:
                return phase, pace

    def _blend(self, phase: float, which: int) -> tuple[float, float]:
        """Return amplitude (0) or period (1) at a phase, and its derivative [1/rad]."""
        number = round(phase / (2.0 * math.pi))
        before, after = (self.cycles[min(max(i, 0), len(self.cycles) - 1)][which] for i in (number - 1, number))
        part = (phase - 2.0 * math.pi * number + QUARTER) / math.pi
        if part <= 0.0 or before == after:
            return before if part <= 0.0 else after, 0.0
        if part >= 1.0:
            return after, 0.0
        share = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
        slope = 30.0 * (part * (1.0 - part)) ** 2 / math.pi
        return before + share * (after - before), slope * (after - before)

    def _time(self, phase: float) -> float:
        """Return the time at a phase [s]: the integral of the period over the phase."""
        time = self.cycles[0].period_s * phase
        for i, (one, other) in enumerate(pairwise(self.cycles), start=1):
            part = min(max((phase - 2.0 * math.pi * i + QUARTER) / math.pi, 0.0), 1.0)
            beyond = max(0.0, phase - 2.0 * math.pi * i - QUARTER)
            time += (other.period_s - one.period_s) * (math.pi * part**4 * (2.5 - 3.0 * part + part**2) + beyond)
        return time / (2.0 * math.pi)


def _eased(time_s: float, ease_s: float) -> tuple[float, float]:
    """Return the cubic step of a time over an easing, and its rate [1/s]."""
    part = time_s / max(ease_s, 1e-3)
    if part <= 0.0:
        return 0.0, 0.0
    if part >= 1.0:
        return 1.0, 0.0
    return part * part * (3.0 - 2.0 * part), 6.0 * part * (1.0 - part) / max(ease_s, 1e-3)


def scattered(
    cycle: Cycle, count: int, amplitude_scatter: float, period_scatter: float, rng: np.random.Generator
) -> tuple[Cycle, ...]:
    """Draw the cycles of a train around one.

    Parameters
    ----------
    cycle : Cycle
        The mean.
    count : int
    amplitude_scatter, period_scatter : float
        Standard deviations over the mean; no cycle is farther off than ``FURTHEST`` of them.
    rng : numpy.random.Generator

    Returns
    -------
    tuple of Cycle
        The periods sum up to ``count`` times the mean: the train ends when it is planned to. What that takes from
        their scatter is given back.
    """
    draws = np.clip(rng.standard_normal((2, count)), -CUT, CUT) / CUT_STD
    about = draws[1] - draws[1].mean()
    about *= math.sqrt(count / (count - 1)) if count > 1 else 0.0
    about *= min(1.0, FURTHEST / max(float(np.abs(about).max()), FURTHEST))
    amplitudes = cycle.amplitude_deg * (1.0 + amplitude_scatter * draws[0])
    periods = cycle.period_s * (1.0 + period_scatter * about)
    return tuple(Cycle(*pair) for pair in zip(amplitudes.tolist(), periods.tolist(), strict=True))
