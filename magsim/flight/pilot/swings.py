"""What the autopilot is commanded for each train: the angle that makes its axis fly as asked, over time.

The loops answer a sine with another amplitude and late. A swing is the train divided by their gain, as early as they
are late, easing included; cycles of different periods have gains of their own. In a combined maneuver an axis is fed a
part of another one's swing. Ten times a second the sum of an axis's swings becomes a cubic of time for the autopilot.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from magsim.flight.model.autopilot import AXES, swing_of
from magsim.flight.pilot.cycles import Cycle, TrainCurve
from magsim.flight.pilot.guidance import TICK_HZ
from magsim.flight.pilot.response import FED, LoopResponse
from magsim.flight.pilot.trains import SineTrain

TICK_S = 1.0 / TICK_HZ
DIFFERENCE_S = 1e-3
"""Half of the step of a central difference."""


@dataclass(frozen=True)
class Swing:
    """Commanded angle of one axis for one train.

    Attributes
    ----------
    axis : str
    start_s : float
        Beginning of the first cycle, on the clock of the train.
    curve : TrainCurve
    direct, quadrature : float, float [s]
        Factors of the curve and of its derivative; (1, 0) for an axis's own train.
    """

    axis: str
    start_s: float
    curve: TrainCurve
    direct: float = 1.0
    quadrature: float = 0.0

    @property
    def begin_s(self) -> float:
        """Time at which it begins to rise [s]."""
        return self.start_s - self.curve.ease_in_s

    @property
    def end_s(self) -> float:
        """Time from which on it is at rest [s]."""
        return self.start_s + self.curve.stop_s + self.curve.ease_out_s

    def at(self, time_s: float) -> tuple[float, float]:
        """Return angle [rad] and rate [rad/s] at a time."""
        tau = time_s - self.start_s
        angle, rate = self.curve.at(tau)
        if not self.quadrature:
            return math.radians(self.direct * angle), math.radians(self.direct * rate)
        before, after = (self._mixed(tau + d) for d in (-DIFFERENCE_S, DIFFERENCE_S))
        return math.radians(self._mixed(tau)), math.radians((after - before) / (2.0 * DIFFERENCE_S))

    def _mixed(self, tau: float) -> float:
        angle, rate = self.curve.at(tau)
        return self.direct * angle + self.quadrature * rate


def swings_of(train: SineTrain, response: LoopResponse) -> list[Swing]:
    """Return the swings of a train: its own, and what another axis is fed of it."""
    drive = response.drive(train)
    own = Swing(train.axis, train.start_s - drive.lead / train.omega, _driven(train, train.axis, response))
    out = [own]
    other = FED.get(train.axis, "")
    fed = response.maneuvers.get(train.maneuver, {}).get(other)
    if fed is not None and fed.feed is not None:
        out.append(Swing(other, own.start_s, own.curve, *fed.feed))
    if train.roll_part:
        _, phase = response.at("roll", train.period_s)
        curve = _driven(train, "roll", response)
        out.append(Swing("roll", train.start_s + phase / train.omega, curve, train.roll_part))
    return out


def _driven(train: SineTrain, axis: str, response: LoopResponse) -> TrainCurve:
    """Return the curve of a train for an axis whose gain at each period is divided out."""
    calibrated = response.drive(train).gain if train.maneuver in response.maneuvers and axis == train.axis else None
    cycles = [
        Cycle(cycle.amplitude_deg / (calibrated or response.at(axis, cycle.period_s)[0]), cycle.period_s)
        for cycle in train.curve.cycles
    ]
    return TrainCurve(tuple(cycles), train.ease_in_s, train.ease_out_s)


class _Waiting(NamedTuple):
    """A train that has not begun, and its swings."""

    begin_s: float
    train: SineTrain
    swings: list[Swing]


class SwingCommands:
    """Trains in time: which are flown, and what the autopilot is commanded for them."""

    def __init__(self) -> None:
        self._waiting: list[_Waiting] = []
        self._moving: list[Swing] = []
        self._last = dict.fromkeys(AXES, (0.0, 0.0))
        self._resting = set(AXES)

    def add(self, trains: Sequence[SineTrain], response: LoopResponse) -> None:
        """Put trains in the order in which they begin."""
        for train in trains:
            swings = swings_of(train, response)
            self._waiting.append(_Waiting(min(swing.begin_s for swing in swings), train, swings))
        self._waiting.sort(key=lambda waiting: waiting.begin_s)

    def begun(self, time_s: float) -> Iterator[SineTrain]:
        """Yield each train on the last tick before it begins to rise."""
        while self._waiting and self._waiting[0].begin_s < time_s + TICK_S:
            _, train, swings = self._waiting.pop(0)
            self._moving += swings
            yield train

    def commands(self, time_s: float) -> Iterator[tuple[str, float]]:
        """Yield properties and values of the cubics from a tick to the next one; none for an axis at rest."""
        if not self._moving and len(self._resting) == len(AXES):
            return
        self._moving = [swing for swing in self._moving if swing.end_s > time_s]
        for axis in AXES:
            swings = [swing for swing in self._moving if swing.axis == axis]
            angle, rate = self._last[axis]
            if not swings and axis in self._resting:
                continue
            then = [swing.at(time_s + TICK_S) for swing in swings]
            end, ending = math.fsum(value for value, _ in then), math.fsum(value for _, value in then)
            moved = end - angle
            second = 2.0 * (3.0 * moved - (2.0 * rate + ending) * TICK_S) / TICK_S**2
            third = 6.0 * ((rate + ending) * TICK_S - 2.0 * moved) / TICK_S**3
            yield from zip(swing_of(axis), (angle, rate, second, third), strict=True)
            self._last[axis] = end, ending
            # A cubic that has come to rest is written once more, as zero.
            at_rest = not swings and angle == rate == end == ending == 0.0
            (self._resting.add if at_rest else self._resting.discard)(axis)
