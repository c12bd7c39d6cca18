"""What the autopilot is commanded for each train: the angle that makes its axis fly as asked, over time.

The loops answer a sine with another amplitude and late. A swing is the train divided by their gain, as early as they
are late, easing included; cycles of different periods have gains of their own. In a combined maneuver an axis is fed a
part of another one's swing. Ten times a second the sum of an axis's swings becomes a cubic of time for the autopilot.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim.flight.model.autopilot import AXES, swing_of
from magsim.flight.pilot.curves import value_at
from magsim.flight.pilot.cycles import Cycle, PlacedCurve, TrainCurve, table_of
from magsim.flight.pilot.response import FED, LoopResponse
from magsim.flight.pilot.steering import TICK_HZ
from magsim.flight.pilot.trains import SineTrain
from magsim.storage.compiled import Record, compiled

ORDERS = tuple(name for axis in AXES for name in swing_of(axis))
"""The properties of all swings."""

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

    @property
    def placed(self) -> PlacedCurve:
        """The curve for the compiled commands."""
        period_s = self.curve.stop_s / len(self.curve.cycles)
        return PlacedCurve(self.axis, self.start_s, self.curve, self.end_s, period_s, self.direct, self.quadrature)


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
    """Trains in time: which of them begin, and the swings that ``cubics`` commands.

    Attributes
    ----------
    next_s : float
        When the next swing begins to rise; infinite if none waits.
    table : (arrays)
        Swings that have begun, from ``table_of``.
    last : (3, 3)
        Angle [rad] and rate [rad/s] that each axis has come to, and whether it rests.
    """

    def __init__(self) -> None:
        self._waiting: list[_Waiting] = []
        self._moving: list[Swing] = []
        self.next_s = math.inf
        self.table = table_of([])
        self.last = np.array([(0.0, 0.0, 1.0)] * len(AXES))

    def add(self, trains: Sequence[SineTrain], response: LoopResponse) -> None:
        """Put trains in the order in which they begin."""
        for train in trains:
            swings = swings_of(train, response)
            self._waiting.append(_Waiting(min(swing.begin_s for swing in swings), train, swings))
        self._waiting.sort(key=lambda waiting: waiting.begin_s)
        self._look()

    def begun(self, time_s: float) -> list[SineTrain]:
        """Return the trains whose last tick before they begin to rise this is."""
        out: list[SineTrain] = []
        while self.next_s < time_s + TICK_S:
            _, train, swings = self._waiting.pop(0)
            self._moving = [swing for swing in self._moving if swing.end_s > time_s] + swings
            out.append(train)
            self._look()
        if out:
            self.table = table_of([swing.placed for swing in self._moving])
        return out

    def _look(self) -> None:
        self.next_s = self._waiting[0].begin_s if self._waiting else math.inf


@compiled
def cubics(
    swings: np.ndarray,
    cycles: np.ndarray,
    last: np.ndarray,
    time_s: float,
    which: np.ndarray,
    values: np.ndarray,
    count: int,
    first: int,
) -> int:
    """Write what the autopilot is commanded from a tick to the next one; nothing for an axis at rest.

    Parameters
    ----------
    swings, cycles : arrays
        From ``table_of``; those that are over count no more.
    last : (3, 3)
        As in ``SwingCommands``.
    time_s : float
    which, values : (n,)
        Get numbers and values of ``ORDERS``, after those that are there.
    count : int
        Of those.
    first : int
        Number that the first of ``ORDERS`` has there.

    Returns
    -------
    int
        How many are there now.
    """
    for axis in range(len(last)):
        moving, end, ending = False, 0.0, 0.0
        for swing in swings:
            if swing.axis == axis and swing.over_s > time_s:
                moving = True
                angle, rate = _swing_at(swing, cycles, time_s + TICK_S)
                end, ending = end + angle, ending + rate
        if not moving and last[axis, 2] == 1.0:
            continue
        angle, rate = last[axis, 0], last[axis, 1]
        moved = end - angle
        values[count], values[count + 1] = angle, rate
        values[count + 2] = 2.0 * (3.0 * moved - (2.0 * rate + ending) * TICK_S) / TICK_S**2
        values[count + 3] = 6.0 * ((rate + ending) * TICK_S - 2.0 * moved) / TICK_S**3
        for order in range(4):
            which[count + order] = first + 4 * axis + order
        count += 4
        # A cubic that has come to rest is written once more, as zero.
        at_rest = not moving and angle == 0.0 and rate == 0.0 and end == 0.0 and ending == 0.0
        last[axis, 0], last[axis, 1], last[axis, 2] = end, ending, 1.0 if at_rest else 0.0
    return count


@compiled
def _swing_at(swing: Record, cycles: np.ndarray, time_s: float) -> tuple[float, float]:
    """Return commanded angle [rad] and rate [rad/s] of a record of ``curves.CURVE`` at a time."""
    if swing.quadrature == 0.0:
        angle, rate = value_at(swing, cycles, time_s)
        return math.radians(swing.direct * angle), math.radians(swing.direct * rate)
    before, after = (_mixed(swing, cycles, time_s - DIFFERENCE_S), _mixed(swing, cycles, time_s + DIFFERENCE_S))
    return math.radians(_mixed(swing, cycles, time_s)), math.radians((after - before) / (2.0 * DIFFERENCE_S))


@compiled
def _mixed(swing: Record, cycles: np.ndarray, time_s: float) -> float:
    angle, rate = value_at(swing, cycles, time_s)
    return swing.direct * angle + swing.quadrature * rate
