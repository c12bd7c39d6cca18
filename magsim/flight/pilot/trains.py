"""Sine trains: how the maneuvers of a leg are flown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from magsim.flight.model.autopilot import AXES
from magsim.flight.path.elements import Label
from magsim.planning import ScheduledOscillation, schedule
from magsim.scenario import LegPattern


class JointSwing(NamedTuple):
    """One axis of a maneuver, on the clock of the maneuver."""

    axis: str
    lag_s: float
    period_s: float
    cycles: int
    amplitude_deg: float
    ease_in_s: float
    ease_out_s: float


Joint = tuple[JointSwing, ...]
"""A maneuver, combined where it has more than one axis, with all that a calibration of its own depends on."""


@dataclass(frozen=True)
class Sweep:
    """One train on the clock of a flight.

    ``ease_in_s`` before the first cycle the generator rises from nothing, ``ease_out_s`` after the last it falls;
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
    joint: Joint = ()
    """The maneuver that it is a part of."""

    @property
    def kind(self) -> str:
        """``combined`` where several axes swing at once, else the axis."""
        return "combined" if len(self.joint) > 1 else self.axis

    @property
    def stop_s(self) -> float:
        """End of the last cycle [s]."""
        return self.start_s + self.cycles * self.period_s

    @property
    def omega(self) -> float:
        """Angular frequency [rad/s]."""
        return 2.0 * math.pi / self.period_s

    def angle(self, time_s: float) -> float:
        """The swing that is asked at a time [rad]."""
        tau = time_s - self.start_s
        rise = 1.0 + min(0.0, tau) / max(self.ease_in_s, 1e-3)
        fall = 1.0 - max(0.0, time_s - self.stop_s) / max(self.ease_out_s, 1e-3)
        if rise <= 0.0 or fall <= 0.0:
            return 0.0
        envelope = rise * rise * (3.0 - 2.0 * rise) * fall * fall * (3.0 - 2.0 * fall)
        return math.radians(self.amplitude_deg) * envelope * math.sin(self.omega * tau)

    def over(self, time_s: float) -> bool:
        """Whether the generator has come to rest."""
        return time_s >= self.stop_s + self.ease_out_s


def sweeps_of_leg(pattern: LegPattern, label: Label, start_s: float, leg_s: float) -> list[Sweep]:
    """The trains of a leg that begins at a time and takes a time."""
    planned, _ = schedule(pattern, label.index, leg_s)
    trains: dict[int, list[ScheduledOscillation]] = {}
    for swing in planned:
        trains.setdefault(swing.train, []).append(swing)
    joints = {number: joint_of(swings) for number, swings in trains.items()}
    return [
        Sweep(
            swing.axis,
            label.circuit,
            label.leg,
            start_s + swing.start_s,
            swing.period_s,
            swing.cycles,
            swing.amplitude_deg,
            swing.ease_in_s,
            swing.ease_out_s,
            joints[swing.train],
        )
        for swing in planned
    ]


def joint_of(swings: Sequence[ScheduledOscillation]) -> Joint:
    """The swings of one maneuver on its own clock, to the nanosecond, so that equal ones are equal."""
    zero_s = min(swing.start_s for swing in swings)
    return tuple(
        JointSwing(
            swing.axis,
            round(swing.start_s - zero_s, 9),
            swing.period_s,
            swing.cycles,
            swing.amplitude_deg,
            round(swing.ease_in_s, 9),
            round(swing.ease_out_s, 9),
        )
        for swing in sorted(swings, key=lambda swing: AXES.index(swing.axis))
    )


def joint_sweeps(joint: Joint, start_s: float) -> list[Sweep]:
    """The swings of a maneuver that begins at a time, in the order in which they begin to rise."""
    out = [
        Sweep(s.axis, 1, 1, start_s + s.lag_s, s.period_s, s.cycles, s.amplitude_deg, s.ease_in_s, s.ease_out_s, joint)
        for s in joint
    ]
    return sorted(out, key=lambda sweep: sweep.start_s - sweep.ease_in_s)
