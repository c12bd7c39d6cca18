"""The angle of a sine train over time, with cycles of one size or with cycles that scatter.

Between two cycles of different amplitude and period both change by a step of fifth order over the phase, from a quarter
cycle before the joint to a quarter cycle after it. So angle, rate and acceleration have no step, and both peaks of a
cycle have its own amplitude. The time over the phase is known in closed form; it is inverted by Newton's method.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from magsim.flight.model.autopilot import AXES
from magsim.flight.pilot import curves

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
    def table(self) -> np.ndarray:
        """Amplitude [deg] and period [s] of each cycle, (n, 2); (1, 2) where all are the same."""
        return np.array(self.cycles[:1] if len(set(self.cycles)) == 1 else self.cycles, dtype=float)

    @cached_property
    def stop_s(self) -> float:
        """End of the last cycle [s]."""
        return math.fsum(cycle.period_s for cycle in self.cycles)

    @cached_property
    def starts_s(self) -> tuple[float, ...]:
        """Beginning of each cycle, and the end of the last one: where the sine passes zero upward [s]."""
        return tuple(curves.time_at(self.table, 2.0 * math.pi * i) for i in range(len(self.cycles) + 1))

    def at(self, time_s: float) -> tuple[float, float]:
        """Return angle [deg] and rate [deg/s] at a time."""
        return curves.curve_at(self.table, self.stop_s, self.ease_in_s, self.ease_out_s, time_s)


class PlacedCurve(NamedTuple):
    """A curve in the time of a flight, as the compiled rules take it; ``curves.CURVE`` says what the fields are."""

    axis: str
    start_s: float
    curve: TrainCurve
    over_s: float
    period_s: float
    direct: float = 1.0
    quadrature: float = 0.0


def table_of(placed: Sequence[PlacedCurve]) -> tuple[np.ndarray, np.ndarray]:
    """Return curves as the compiled rules take them: records (n,) of ``curves.CURVE`` and all their cycles, (k, 2)."""
    records, cycles = np.zeros(len(placed), curves.CURVE), [np.empty((0, 2))]
    first = 0
    for number, one in enumerate(placed):
        last, curve = first + len(one.curve.table), one.curve
        times = (one.start_s, curve.stop_s, curve.ease_in_s, curve.ease_out_s, one.over_s, one.period_s)
        records[number] = (AXES.index(one.axis), *times, one.direct, one.quadrature, first, last)
        cycles.append(curve.table)
        first = last
    return records, np.concatenate(cycles)


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
