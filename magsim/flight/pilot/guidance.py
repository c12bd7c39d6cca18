"""Following a path ten times a second: place, course and curvature to heading and bank.

The set points of a tick are those of the next one; the autopilot moves to them at a constant rate
(``autopilot.RAMPED``), so none of them jumps. The course error is added to the heading, so the aircraft crabs into the
wind. The bank that the path's curvature needs is commanded one delay ahead. During a roll train, the change of course
that a coordinated turn would give is subtracted from the errors, so that the guidance corrects the rest alone; during
a yaw train the mean heading is held, during a pitch train no height. One way of steering is faded into the next.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from magsim.aircraft.facts import Facts
from magsim.flight.model.aero import derivatives
from magsim.flight.path.elements import Element
from magsim.flight.path.wind import crab_heading
from magsim.flight.pilot.trains import SineTrain
from magsim.units import G0

TICK_HZ = 10
FOOT_M = 0.2
"""Newton's steps to the foot of the aircraft on the path end below this; the error left is its square over R."""

WIND_S = 6.0
"""Time over which the wind is smoothed."""

STILL = (0.0, 0.0)
"""Wind before it has been estimated."""

QUIET_GAIN, QUIET_OMEGA = 0.5, 0.2
"""The course loop during a roll train: at most this part of its gain, and of the train's angular frequency."""


LEAST_BANK = math.radians(5.0)
"""Bank that corrections may always take, in a planned turn too."""

FADE_S = 3.0
"""Time in which one way of steering is faded into another at the ends of a train, so that no control jumps."""

HEIGHT_FADE_S = 8.0
"""Time in which height hold comes back after a pitch train.

A train leaves the height off by a meter or two. In calm air the pitch rate that takes it up is 0.010 deg/s rms (Cessna)
and 0.021 (drone) in the first three seconds; with 4 s it would be 0.025 and 0.041.
"""

SETTLE_S = 1.0
"""Time constant with which a held heading or bank takes a new value where one train follows another of its axis."""


class Crossing(NamedTuple):
    """The moment at which an element of the path was entered."""

    element: int
    """Its index in the path."""
    time_s: float


class GuidanceInput(NamedTuple):
    """Position and velocity in the plane, heading, airspeed and sink rate."""

    north_m: float
    east_m: float
    v_north: float
    v_east: float
    heading: float
    airspeed: float
    v_down: float = 0.0


class SetPoints(NamedTuple):
    """Set points of the autopilot at the next tick; the loops that hold something have shares, 0 to 1."""

    heading: float
    bank: float
    hold_heading: float
    hold_yaw: float
    hold_height: float


def wrap(angle: float) -> float:
    """Wrap an angle [rad] to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


class _Fade:
    """A share that fades between 0 and 1 by a cubic step."""

    def __init__(self, part: float) -> None:
        self._part = part
        self.share = part

    def move(self, on: bool, fade_s: float = FADE_S) -> None:
        """Move one tick towards 1 or 0."""
        if self._part == on:
            return
        step = 1.0 / (fade_s * TICK_HZ)
        part = self._part = min(1.0, self._part + step) if on else max(0.0, self._part - step)
        self.share = part * part * (3.0 - 2.0 * part)


def _settled(held: float, goal: float) -> float:
    """Return a held angle [rad] one tick later on its way to a new value."""
    return held + wrap(goal - held) / (SETTLE_S * TICK_HZ)


def _weathercock(facts: Facts) -> float:
    """Return the heading error that the rudder holds, over the sideslip that causes it."""
    gains, effect = facts.autopilot, derivatives(facts)
    rudder = max(-facts.controls.rudder.travel.value[0], facts.controls.rudder.travel.value[1])
    return -effect.yaw_beta / (effect.yaw_rudder * rudder * gains.yaw_rate.value * gains.yaw.value)


class Guidance:
    """Keeps track of the position along a path and steers to it.

    Parameters
    ----------
    path : sequence of Element
    facts : Facts
    along_m : float
        Where on the first element the flight begins; negative is before it.
    most_bank : float
        Bank [rad] to which corrections are held, so that they keep clear of the stall.
    gusty : bool
        Whether the air is turbulent.
    """

    def __init__(
        self,
        path: Sequence[Element],
        facts: Facts,
        along_m: float,
        most_bank: float = math.inf,
        *,
        gusty: bool = False,
    ) -> None:
        gains = facts.autopilot
        self._path = path
        self._course_gain = gains.course.value
        self._line_s = gains.line.value
        self._intercept = gains.intercept_limit.value
        self._lead_s = gains.bank_lag.value
        self._held = self._held_course = 0.0
        self._held_goal: tuple[float, float] | None = None
        self._weathercock = _weathercock(facts)
        self._most_bank = most_bank
        self._heading, self._height = _Fade(1.0), _Fade(1.0)
        self._quiet, self._yaw, self._banked = _Fade(0.0), _Fade(0.0), _Fade(0.0)
        self._quiet_bank = 0.0
        self._wind: tuple[float, float] | None = None
        self._gusty = gusty
        self._steady = _Fade(float(gusty))
        self._roll_course, self._roll_off_m = 0.0, 0.0
        self._off_m = self._v_down = 0.0
        self._place = path[0].at(along_m)
        self.index = 0
        self.along_m = along_m
        self.crossings: list[Crossing] = []
        self.finished_s: float | None = None

    @property
    def off_m(self) -> float:
        """Distance from the path at the last tick, positive to the right [m]."""
        return self._off_m

    def step(self, time_s: float, motion: GuidanceInput, trains: Sequence[SineTrain]) -> SetPoints:
        """Steer for the next tick.

        Parameters
        ----------
        time_s : float
        motion : GuidanceInput
        trains : sequence of SineTrain
            Trains that are flown, from the beginning of their rise to the end of their fall.
        """
        speed = math.hypot(motion.v_north, motion.v_east)
        self._advance(time_s, motion, speed)
        axes = {train.axis for train in trains}
        rising, self._v_down = (self._v_down - motion.v_down) * TICK_HZ, motion.v_down
        lifted = G0 + rising if "pitch" in axes else G0
        rolls = [train for train in trains if train.axis == "roll"]
        self._follow_roll(time_s, speed, rolls, lifted)
        if rolls:
            self._steer_quietly(speed, motion, rolls)
        if "yaw" in axes:
            self._hold_yaw(speed, motion, max(train.stop_s + train.ease_out_s for train in trains) - time_s)
        else:
            self._held_goal = None
        lead = self._lead_bank(speed, motion)
        self._steady.move(self._gusty and lead == 0.0 and self._place.curvature == 0.0)
        if not axes and (self._steady.share == 1.0 or not self._gusty):
            self._estimate_wind(motion)
        heading = self._free_heading(speed, motion, lead)
        if self._yaw.share:
            # The banked lift of a roll train changes the course, slowly too under a pitch train; the heading must not
            # follow.
            turned = wrap(math.atan2(motion.v_east, motion.v_north) - self._held_course)
            held = self._held - self._banked.share * self._weathercock * turned
            heading += self._yaw.share * wrap(held - heading)
        bank = lead + self._quiet.share * self._quiet_bank
        self._fade(axes)
        return SetPoints(heading % (2.0 * math.pi), bank, self._heading.share, self._yaw.share, self._height.share)

    def _fade(self, axes: set[str]) -> None:
        """Move between the heading loop, the quiet course loop of a roll train, and neither in a yaw train."""
        level = "pitch" not in axes
        self._height.move(level, HEIGHT_FADE_S if level else FADE_S)
        self._heading.move(not axes & {"roll", "yaw"})
        self._quiet.move("roll" in axes and "yaw" not in axes)
        self._yaw.move("yaw" in axes)
        self._banked.move("roll" in axes)

    def _free_heading(self, speed: float, motion: GuidanceInput, lead: float) -> float:
        """Return the heading [rad] of the next tick that leads back to the path.

        It is the heading flown and what the course lacks. On the straights of a flight in gusts it is that of the
        course in the mean wind, as crews and autopilots hold a heading: gusts swing the nose, and the bank answers.
        """
        error = self._course_error(speed, motion, self._line_s)
        most = max(LEAST_BANK, self._most_bank - abs(lead)) * G0 / (self._course_gain * motion.airspeed)
        error = max(-most, min(most, error))
        if self._steady.share:
            course = math.atan2(motion.v_east, motion.v_north) + error
            swing = wrap(crab_heading(motion.airspeed, course, self._wind or STILL) - motion.heading - error)
            error += self._steady.share * max(-most, min(most, swing))
        return motion.heading + error + speed * self._place.curvature / TICK_HZ

    def _steer_quietly(self, speed: float, motion: GuidanceInput, rolls: Sequence[SineTrain]) -> None:
        """Set the bank of the course loop during a roll train: slow beside the train, blind to the course it makes."""
        gain = min(QUIET_GAIN * self._course_gain, QUIET_OMEGA * min(train.omega for train in rolls))
        error = self._course_error(speed, motion, self._line_s * self._course_gain / gain)
        bank = gain * motion.airspeed / G0 * (error + self._roll_course)
        self._quiet_bank = _settled(self._quiet_bank, bank) if self._quiet.share else bank

    def _hold_yaw(self, speed: float, motion: GuidanceInput, lasts_s: float) -> None:
        """Set the heading of a yaw train: that of the course that comes back to the line by the end of the trains."""
        if self._held_goal is None:
            error = self._course_error(speed, motion, max(self._line_s, lasts_s))
            course = math.atan2(motion.v_east, motion.v_north) + error
            self._held_goal = crab_heading(motion.airspeed, course, self._wind or STILL), course
            if not self._yaw.share:
                self._held, self._held_course = self._held_goal
        heading, course = self._held_goal
        self._held, self._held_course = _settled(self._held, heading), _settled(self._held_course, course)

    def _estimate_wind(self, motion: GuidanceInput) -> None:
        """Estimate the wind as the smoothed difference of ground and air velocity, where no maneuver is flown."""
        heading = motion.heading
        north = motion.v_north - motion.airspeed * math.cos(heading)
        east = motion.v_east - motion.airspeed * math.sin(heading)
        old_north, old_east = self._wind or (north, east)
        part = 1.0 / (WIND_S * TICK_HZ)
        self._wind = old_north + part * (north - old_north), old_east + part * (east - old_east)

    def _follow_roll(self, time_s: float, speed: float, trains: Sequence[SineTrain], lifted: float) -> None:
        """Integrate course and distance from the path that a roll train causes: turn rate g tan(bank) / V.

        ``lifted`` is the acceleration that the lift supports: g, plus the vertical acceleration of a pitch train.
        """
        if not trains:
            self._roll_course, self._roll_off_m = 0.0, 0.0
            return
        step_s = 1.0 / TICK_HZ
        bank = math.fsum(train.angle(time_s - 0.5 * step_s) for train in trains)
        before = self._roll_course
        self._roll_course += step_s * lifted * math.tan(bank) / speed
        self._roll_off_m += step_s * speed * math.sin(0.5 * (before + self._roll_course))

    def _advance(self, time_s: float, motion: GuidanceInput, speed: float) -> None:
        """Move along the path to the foot of the aircraft; record the elements that were entered."""
        self.along_m += speed / TICK_HZ
        while True:
            element = self._path[self.index]
            ahead_m = math.inf
            while abs(ahead_m) > FOOT_M:
                north, east, course, curvature = self._place = element.at(self.along_m)
                north, east = motion.north_m - north, motion.east_m - east
                sin, cos = math.sin(course), math.cos(course)
                self._off_m = east * cos - north * sin
                ahead_m = (north * cos + east * sin) / max(0.2, 1.0 - curvature * self._off_m)
                self.along_m += ahead_m
            if not self.crossings and self.along_m >= 0.0:
                self.crossings.append(Crossing(0, time_s - self.along_m / speed))
            if self.along_m < element.length_m:
                return
            crossed_s = time_s - (self.along_m - element.length_m) / speed
            if self.index + 1 == len(self._path):
                if self.finished_s is None:
                    self.finished_s = crossed_s
                return
            self.along_m -= element.length_m
            self.index += 1
            self.crossings.append(Crossing(self.index, crossed_s))

    def _course_error(self, speed: float, motion: GuidanceInput, line_s: float) -> float:
        """Return the turn [rad] to the course that closes the distance from the path in a time."""
        back = math.atan((self._off_m - self._roll_off_m) / (speed * line_s))
        wanted = self._place.course - max(-self._intercept, min(self._intercept, back))
        return wrap(wanted - math.atan2(motion.v_east, motion.v_north))

    def _lead_bank(self, speed: float, motion: GuidanceInput) -> float:
        """Return the bank of the next tick for the curvature one roll delay ahead of it.

        It is ``V_ground^2 / (R g)`` over the cosine of the crab.
        """
        ahead = self.along_m + speed * (self._lead_s + 1.0 / TICK_HZ)
        index = self.index
        while ahead > self._path[index].length_m and index + 1 < len(self._path):
            ahead -= self._path[index].length_m
            index += 1
        curvature = self._path[index].curvature(ahead)
        if curvature == 0.0:
            return 0.0
        crab = wrap(math.atan2(motion.v_east, motion.v_north) - motion.heading)
        return math.atan(speed**2 * curvature / (G0 * math.cos(crab)))
