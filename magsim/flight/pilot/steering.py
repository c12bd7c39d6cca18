"""Steering along a path ten times a second: place, course and curvature to heading and bank.

The set points of a tick are those of the next one; the autopilot moves to them at a constant rate
(``autopilot.RAMPED``), so none of them jumps. The course error is added to the heading, so the aircraft crabs into the
wind. The bank that the path's curvature needs is commanded one delay ahead. During a roll train, the change of course
that a coordinated turn would give is subtracted from the errors, so that the guidance corrects the rest alone; during
a yaw train the mean heading is held, during a pitch train no height. One way of steering is faded into the next.

The rules are compiled; what they remember from tick to tick is a record of ``MEMORY``.
"""

import math

import numpy as np

from magsim.flight.path.turns import curvature_at, point_at
from magsim.flight.path.wind import crab_heading
from magsim.flight.pilot.curves import value_at
from magsim.storage.compiled import Record, compiled
from magsim.units import G0

TICK_HZ = 10
FOOT_M = 0.2
"""Newton's steps to the foot of the aircraft on the path end below this; the error left is its square over R."""

WIND_S = 6.0
"""Time over which the wind is smoothed."""

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

PITCH, ROLL, YAW = 0, 1, 2
"""Numbers of the axes, in the order of ``AXES``."""

MEMORY = np.dtype(
    [
        # settings
        ("grid", "f8"),
        ("course_gain", "f8"),
        ("line_s", "f8"),
        ("intercept", "f8"),
        ("lead_s", "f8"),
        ("weathercock", "f8"),
        ("most_bank", "f8"),
        ("gusty", "?"),
        ("tolerance_m", "f8"),
        # where the aircraft is on the path, and how far it has come
        ("along_m", "f8"),
        ("off_m", "f8"),
        ("course", "f8"),
        ("curvature", "f8"),
        ("index", "i8"),
        ("crossed", "i8"),
        ("finished_s", "f8"),
        ("v_down", "f8"),
        # the parts of fades, from 0 to 1; their shares are cubic steps of them
        ("heading", "f8"),
        ("height", "f8"),
        ("quiet", "f8"),
        ("yaw", "f8"),
        ("banked", "f8"),
        ("steady", "f8"),
        # what is held in a yaw train, and where that is going
        ("held", "f8"),
        ("held_course", "f8"),
        ("goal", "f8"),
        ("goal_course", "f8"),
        ("aimed", "?"),
        # what a roll train has done to course and place, and the bank of the quiet course loop
        ("roll_course", "f8"),
        ("roll_off_m", "f8"),
        ("quiet_bank", "f8"),
        # the mean wind, once it has been estimated
        ("wind_north", "f8"),
        ("wind_east", "f8"),
        ("wind_known", "?"),
        # the angle from the autopilot's headings to those of the plane
        ("turned", "f8"),
    ]
)
"""What the guidance knows and remembers."""


@compiled
def wrap(angle: float) -> float:
    """Wrap an angle [rad] to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@compiled
def share_of(part: float) -> float:
    """Return the share, 0 to 1, of a part of a fade: a cubic step."""
    return part * part * (3.0 - 2.0 * part)


@compiled
def _faded(part: float, on: bool, fade_s: float) -> float:
    """Return the part of a fade one tick later on its way to 1 or 0."""
    step = 1.0 / (fade_s * TICK_HZ)
    return min(1.0, part + step) if on else max(0.0, part - step)


@compiled
def _settled(held: float, goal: float) -> float:
    """Return a held angle [rad] one tick later on its way to a new value."""
    return held + wrap(goal - held) / (SETTLE_S * TICK_HZ)


@compiled
def steer(
    m: Record,
    path: tuple[np.ndarray, np.ndarray, np.ndarray],
    trains: np.ndarray,
    cycles: np.ndarray,
    time_s: float,
    motion: tuple[float, float, float, float, float, float, float],
) -> tuple[float, float]:
    """Return heading and bank [rad] of the next tick; the shares of the loops are fades of the memory.

    Parameters
    ----------
    m : record of MEMORY
        Stepped by one tick.
    path : (elements, points, crossed_s)
        As in ``Guidance``.
    trains : (n,) of CURVE
        Trains that are flown, from the beginning of their rise to the end of their fall.
    cycles : (k, 2)
        Of all trains.
    time_s : float
    motion : north [m], east [m], their rates, heading [rad], airspeed, sink rate [m/s]
        In the plane.
    """
    _, _, v_north, v_east, own_heading, airspeed, v_down = motion
    speed = math.hypot(v_north, v_east)
    course = math.atan2(v_east, v_north)
    _advance(m, path, time_s, motion, speed)
    pitches, rolls, yaws = _flown(trains, PITCH), _flown(trains, ROLL), _flown(trains, YAW)
    rising, m.v_down = (m.v_down - v_down) * TICK_HZ, v_down
    _follow_roll(m, trains, cycles, time_s, speed, G0 + rising if pitches else G0)
    if rolls:
        _steer_quietly(m, trains, speed, airspeed, course)
    if yaws:
        _hold_yaw(m, trains, speed, airspeed, course, time_s)
    else:
        m.aimed = False
    lead = _lead_bank(m, path[0], speed, course, own_heading)
    m.steady = _faded(m.steady, m.gusty and lead == 0.0 and m.curvature == 0.0, FADE_S)
    if not (pitches or rolls or yaws) and (share_of(m.steady) == 1.0 or not m.gusty):
        _estimate_wind(m, motion)
    heading = _free_heading(m, speed, airspeed, own_heading, course, lead)
    if m.yaw != 0.0:
        # The banked lift of a roll train changes the course, slowly too under a pitch train; the heading must not
        # follow.
        held = m.held - share_of(m.banked) * m.weathercock * wrap(course - m.held_course)
        heading += share_of(m.yaw) * wrap(held - heading)
    bank = lead + share_of(m.quiet) * m.quiet_bank
    m.height = _faded(m.height, not pitches, HEIGHT_FADE_S if not pitches else FADE_S)
    m.heading = _faded(m.heading, not (rolls or yaws), FADE_S)
    m.quiet = _faded(m.quiet, rolls and not yaws, FADE_S)
    m.yaw = _faded(m.yaw, yaws, FADE_S)
    m.banked = _faded(m.banked, rolls, FADE_S)
    return heading % (2.0 * math.pi), bank


@compiled
def _flown(trains: np.ndarray, axis: int) -> bool:
    """Whether a train of an axis is flown."""
    flown = False
    for train in trains:
        flown = flown or train.axis == axis
    return flown


@compiled
def _free_heading(m: Record, speed: float, airspeed: float, own_heading: float, course: float, lead: float) -> float:
    """Return the heading [rad] of the next tick that leads back to the path.

    It is the heading flown and what the course lacks. On the straights of a flight in gusts it is that of the
    course in the mean wind, as crews and autopilots hold a heading: gusts swing the nose, and the bank answers.
    """
    error = _course_error(m, speed, course, m.line_s)
    most = max(LEAST_BANK, m.most_bank - abs(lead)) * G0 / (m.course_gain * airspeed)
    error = max(-most, min(most, error))
    if m.steady != 0.0:
        swing = wrap(crab_heading(airspeed, course + error, (m.wind_north, m.wind_east)) - own_heading - error)
        error += share_of(m.steady) * max(-most, min(most, swing))
    return own_heading + error + speed * m.curvature / TICK_HZ


@compiled
def _steer_quietly(m: Record, trains: np.ndarray, speed: float, airspeed: float, course: float) -> None:
    """Set the bank of the course loop during a roll train: slow beside the train, blind to the course it makes."""
    gain = QUIET_GAIN * m.course_gain
    for train in trains:
        if train.axis == ROLL:
            gain = min(gain, QUIET_OMEGA * 2.0 * math.pi / train.period_s)
    error = _course_error(m, speed, course, m.line_s * m.course_gain / gain)
    bank = gain * airspeed / G0 * (error + m.roll_course)
    m.quiet_bank = _settled(m.quiet_bank, bank) if m.quiet != 0.0 else bank


@compiled
def _hold_yaw(m: Record, trains: np.ndarray, speed: float, airspeed: float, course: float, time_s: float) -> None:
    """Set the heading of a yaw train: that of the course that comes back to the line by the end of the trains."""
    if not m.aimed:
        lasts_s = m.line_s
        for train in trains:
            lasts_s = max(lasts_s, train.over_s - time_s)
        m.goal_course = course + _course_error(m, speed, course, lasts_s)
        m.goal = crab_heading(airspeed, m.goal_course, (m.wind_north, m.wind_east))
        m.aimed = True
        if m.yaw == 0.0:
            m.held, m.held_course = m.goal, m.goal_course
    m.held, m.held_course = _settled(m.held, m.goal), _settled(m.held_course, m.goal_course)


@compiled
def _estimate_wind(m: Record, motion: tuple[float, float, float, float, float, float, float]) -> None:
    """Estimate the wind as the smoothed difference of ground and air velocity, where no maneuver is flown."""
    _, _, v_north, v_east, heading, airspeed, _ = motion
    north, east = v_north - airspeed * math.cos(heading), v_east - airspeed * math.sin(heading)
    if not m.wind_known:
        m.wind_north, m.wind_east, m.wind_known = north, east, True
    part = 1.0 / (WIND_S * TICK_HZ)
    m.wind_north += part * (north - m.wind_north)
    m.wind_east += part * (east - m.wind_east)


@compiled
def _follow_roll(m: Record, trains: np.ndarray, cycles: np.ndarray, time_s: float, speed: float, lifted: float) -> None:
    """Integrate course and distance from the path that a roll train causes: turn rate g tan(bank) / V.

    ``lifted`` is the acceleration that the lift supports: g, plus the vertical acceleration of a pitch train.
    """
    step_s = 1.0 / TICK_HZ
    bank, rolls = 0.0, False
    for train in trains:
        if train.axis == ROLL:
            rolls = True
            bank += math.radians(value_at(train, cycles, time_s - 0.5 * step_s)[0])
    if not rolls:
        m.roll_course, m.roll_off_m = 0.0, 0.0
        return
    before = m.roll_course
    m.roll_course += step_s * lifted * math.tan(bank) / speed
    m.roll_off_m += step_s * speed * math.sin(0.5 * (before + m.roll_course))


@compiled
def _advance(
    m: Record,
    path: tuple[np.ndarray, np.ndarray, np.ndarray],
    time_s: float,
    motion: tuple[float, float, float, float, float, float, float],
    speed: float,
) -> None:
    """Move along the path to the foot of the aircraft; record the elements that were entered."""
    elements, points, crossed_s = path
    m.along_m += speed / TICK_HZ
    while True:
        length_m, ahead_m = elements[m.index].length_m, math.inf
        while abs(ahead_m) > FOOT_M:
            north, east, m.course, m.curvature = point_at(elements, points, m.index, m.along_m)
            north, east = motion[0] - north, motion[1] - east
            sin, cos = math.sin(m.course), math.cos(m.course)
            m.off_m = east * cos - north * sin
            ahead_m = (north * cos + east * sin) / max(0.2, 1.0 - m.curvature * m.off_m)
            m.along_m += ahead_m
        if m.crossed == 0 and m.along_m >= 0.0:
            crossed_s[0] = time_s - m.along_m / speed
            m.crossed = 1
        if m.along_m < length_m:
            return
        passed_s = time_s - (m.along_m - length_m) / speed
        if m.index + 1 == len(elements):
            if math.isnan(m.finished_s):
                m.finished_s = passed_s
            return
        m.along_m -= length_m
        m.index += 1
        crossed_s[m.index] = passed_s
        m.crossed = m.index + 1


@compiled
def _course_error(m: Record, speed: float, course: float, line_s: float) -> float:
    """Return the turn [rad] to the course that closes the distance from the path in a time."""
    back = math.atan((m.off_m - m.roll_off_m) / (speed * line_s))
    return wrap(m.course - max(-m.intercept, min(m.intercept, back)) - course)


@compiled
def _lead_bank(m: Record, elements: np.ndarray, speed: float, course: float, own_heading: float) -> float:
    """Return the bank of the next tick for the curvature one roll delay ahead of it.

    It is ``V_ground^2 / (R g)`` over the cosine of the crab.
    """
    ahead, index = m.along_m + speed * (m.lead_s + 1.0 / TICK_HZ), m.index
    while ahead > elements[index].length_m and index + 1 < len(elements):
        ahead -= elements[index].length_m
        index += 1
    curvature = curvature_at(elements, index, ahead)
    if curvature == 0.0:
        return 0.0
    return math.atan(speed**2 * curvature / (G0 * math.cos(wrap(course - own_heading))))
