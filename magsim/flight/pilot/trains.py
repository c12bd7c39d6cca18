"""Sine trains: how the maneuvers of a leg are flown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from magsim.flight.model.autopilot import AXES
from magsim.flight.path.elements import PathLabel
from magsim.flight.pilot.cycles import Cycle, PlacedCurve, TrainCurve, scattered
from magsim.planning import ScheduledOscillation, schedule
from magsim.scenario import LegPattern, Maneuver, Train
from magsim.streams import stream


class ManeuverAxis(NamedTuple):
    """One axis of a maneuver, on the clock of the maneuver."""

    axis: str
    lag_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float


ManeuverKey = tuple[ManeuverAxis, ...]
"""A maneuver, combined if it has several axes, with all that its own calibration depends on."""


@dataclass(frozen=True)
class SineTrain:
    """A sine train on the clock of a flight.

    ``ease_in_s`` before the first cycle the sine rises from nothing, ``ease_out_s`` after the last it falls;
    half a period of it keeps the mean of the sine's integral, heading or height, where it was.
    """

    axis: str
    circuit: int
    leg: int
    start_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float
    maneuver: ManeuverKey = ()
    """The maneuver that it is a part of."""
    drawn: tuple[Cycle, ...] = ()
    """Its cycles where they scatter; else all are the same."""
    roll_part: float = 0.0
    """Roll that swings with a yaw train, over its angle."""

    @property
    def kind(self) -> str:
        """``combined`` where several axes swing at once, else the axis."""
        return "combined" if len(self.maneuver) > 1 else self.axis

    @property
    def stop_s(self) -> float:
        """End of the last cycle [s]."""
        return self.start_s + self.cycles * self.period_s

    @property
    def omega(self) -> float:
        """Mean angular frequency [rad/s]."""
        return 2.0 * math.pi / self.period_s

    @cached_property
    def curve(self) -> TrainCurve:
        """The angle over time, on the clock of the train's start."""
        cycles = self.drawn or (Cycle(self.amplitude_deg, self.period_s),) * self.cycles
        return TrainCurve(cycles, self.ease_in_s, self.ease_out_s)

    @property
    def over_s(self) -> float:
        """When it has come to rest [s]."""
        return self.stop_s + self.ease_out_s

    @property
    def placed(self) -> PlacedCurve:
        """The curve that is asked, for the guidance."""
        return PlacedCurve(self.axis, self.start_s, self.curve, self.over_s, self.period_s)

    def angle(self, time_s: float) -> float:
        """Return the angle that is asked at a time [rad]."""
        return math.radians(self.curve.at(time_s - self.start_s)[0])

    def over(self, time_s: float) -> bool:
        """Whether it has come to rest."""
        return time_s >= self.over_s


def trains_of_leg(
    pattern: LegPattern, label: PathLabel, start_s: float, leg_s: float, seed: int = 0
) -> list[SineTrain]:
    """Schedule the trains of a leg that is entered at ``start_s`` and takes ``leg_s`` seconds.

    Cycles that scatter are drawn from the seed by circuit, leg and number of the train on the leg.
    """
    scheduled, _ = schedule(pattern, label.leg_index, leg_s)
    together: dict[int, list[ScheduledOscillation]] = {}
    for oscillation in scheduled:
        together.setdefault(oscillation.train, []).append(oscillation)
    maneuvers = {number: maneuver_of(oscillations) for number, oscillations in together.items()}
    return [
        SineTrain(
            oscillation.axis,
            label.circuit,
            label.leg,
            start_s + oscillation.start_s,
            oscillation.period_s,
            oscillation.cycles,
            oscillation.amplitude_deg,
            oscillation.ease_in_s,
            oscillation.ease_out_s,
            maneuvers[oscillation.train],
            *_by_hand(pattern.maneuvers[oscillation.train], oscillation, label, seed),
        )
        for oscillation in scheduled
    ]


def _by_hand(
    train: Maneuver, planned: ScheduledOscillation, label: PathLabel, seed: int
) -> tuple[tuple[Cycle, ...], float]:
    """Return the cycles of a train that scatters, and the roll that swings with it."""
    if not isinstance(train, Train):
        return (), 0.0
    if not (train.amplitude_scatter or train.period_scatter):
        return (), train.roll_part
    rng = stream(seed, f"maneuver/{label.circuit}/{label.leg}/{planned.train}")
    mean = Cycle(planned.amplitude_deg, planned.period_s)
    return scattered(mean, planned.cycles, train.amplitude_scatter, train.period_scatter, rng), train.roll_part


def maneuver_of(oscillations: Sequence[ScheduledOscillation]) -> ManeuverKey:
    """Describe a maneuver on its own clock, times rounded to the nanosecond, so that equal maneuvers compare equal."""
    zero_s = min(oscillation.start_s for oscillation in oscillations)
    return tuple(
        ManeuverAxis(
            oscillation.axis,
            round(oscillation.start_s - zero_s, 9),
            oscillation.period_s,
            oscillation.cycles,
            oscillation.amplitude_deg,
            round(oscillation.ease_in_s, 9),
            round(oscillation.ease_out_s, 9),
        )
        for oscillation in sorted(oscillations, key=lambda oscillation: AXES.index(oscillation.axis))
    )


def trains_of_maneuver(maneuver: ManeuverKey, start_s: float) -> list[SineTrain]:
    """Return the trains of a maneuver that begins at a time, in the order in which they begin to rise."""
    trains = [
        SineTrain(
            axis.axis,
            1,
            1,
            start_s + axis.lag_s,
            axis.period_s,
            axis.cycles,
            axis.amplitude_deg,
            axis.ease_in_s,
            axis.ease_out_s,
            maneuver,
        )
        for axis in maneuver
    ]
    return sorted(trains, key=lambda train: train.start_s - train.ease_in_s)
