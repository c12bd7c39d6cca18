"""A tick of the guidance, compiled: rows of the plant become the set points that the autopilot moves to.

Whatever happens on few ticks alone is told by flags, so that Python has next to nothing to do on the others.
"""

import math

import numpy as np

from magsim.flight.model.autopilot import RAMP_START, RAMPED, rate_of
from magsim.flight.model.channels import CHANNELS, COLUMN, MOTION
from magsim.flight.model.envelope import TROUBLES, first_outside
from magsim.flight.path.plane import motion_in_plane
from magsim.flight.pilot import swings
from magsim.flight.pilot.monitor import first_stuck, is_missed
from magsim.flight.pilot.steering import TICK_HZ, share_of, steer, wrap
from magsim.storage.compiled import compiled

ORDERS = (*RAMPED, *map(rate_of, RAMPED), *swings.ORDERS, RAMP_START)
"""The properties that are written."""

SWUNG, AT = 2 * len(RAMPED), len(ORDERS) - 1
"""Numbers of the first swing and of the time of the tick."""

OUTSIDE, STUCK, MISSED, BEFORE, ENTERED, FINISHED = (1 << bit for bit in range(6))
"""What a tick tells: a row is outside of the flight model's limits, a control is at its stop, a leg is missed; the path
is not entered yet, one of its elements was entered, its end was passed."""

LAT, LON, V_NORTH, V_EAST, V_DOWN, HEADING, AIRSPEED = (COLUMN[name] for name in MOTION)
SPEED_UNIT = CHANNELS[V_NORTH][2]
"""Factor to SI of all speeds of a row; angles have none."""

HOLD_HEIGHT, HEIGHT, CLIMB, HOLD_HEADING, TO_HEADING, BANK, HOLD_YAW = (
    RAMPED.index(f"ap/{name}")
    for name in ("hold-height", "height-ft", "climb-fps", "hold-heading", "heading-rad", "bank-rad", "hold-yaw")
)


@compiled
def tick(
    memory: np.ndarray,
    elements: np.ndarray,
    points: np.ndarray,
    crossed_s: np.ndarray,
    plane: np.ndarray,
    trains: np.ndarray,
    cycles: np.ndarray,
    swung: np.ndarray,
    swung_cycles: np.ndarray,
    swung_last: np.ndarray,
    targets: np.ndarray,
    watched: np.ndarray,
    limits: np.ndarray,
    wheels: np.ndarray,
    rows: np.ndarray,
    first: int,
    last: int,
    ground_m: float,
    time_s: float,
    clock_s: float,
    which: np.ndarray,
    values: np.ndarray,
) -> tuple[int, int, int, int, float, float]:
    """Check the rows since the last tick, steer, and write what the set points do until the next one.

    Parameters
    ----------
    memory : (1,) of steering.MEMORY
    elements, points, crossed_s : arrays
        As in ``Guidance``.
    plane : (10,)
        ``LocalPlane.table``.
    trains, cycles : arrays
        Trains that are flown, from ``cycles.table_of``.
    swung, swung_cycles, swung_last : arrays
        ``SwingCommands.table`` and ``last``.
    targets : (7, 2)
        Where each of ``RAMPED`` is going; 0 while it has not been set, 1 at rest, 2 moving.
    watched : (k,) of monitor.WATCHED
        Controls that end the flight where they are stuck.
    limits, wheels : arrays
        ``Plant.limits``.
    rows : (n, c)
        Of the plant, in its units.
    first, last : int
        Numbers of the rows since the last tick.
    ground_m : float
    time_s : float
    clock_s : float
        The same moment on JSBSim's clock.
    which, values : (27,)
        Get numbers and values of ``ORDERS``.

    Returns
    -------
    told : int
        Sum of the flags.
    detail : int
        Of the rows, number of the one that is outside, times ``len(TROUBLES)``, and the code of what is wrong; number
        of a control that is stuck.
    count : int
        Of the orders.
    index, along_m : int, float
        Place on the path.
    speed : float [m/s]
        Over ground, in the plane.
    """
    m, row = memory[0], rows[last]
    bad, trouble = first_outside(rows, first, last, limits, wheels, ground_m)
    if trouble != 0:
        return OUTSIDE, bad * len(TROUBLES) + trouble, 0, 0, 0.0, 0.0
    crossed, open_end = m.crossed, math.isnan(m.finished_s)
    lon, v_north, v_east = row[LON], row[V_NORTH] * SPEED_UNIT, row[V_EAST] * SPEED_UNIT
    north, east, to_north, to_east = motion_in_plane(plane, row[LAT], lon, v_north, v_east)
    # Headings of the path and of the guidance are those of the plane: the meridians converge towards the poles.
    turned = math.atan2(to_east, to_north) - math.atan2(v_east, v_north)
    motion = (
        north,
        east,
        to_north,
        to_east,
        row[HEADING] + turned,
        row[AIRSPEED] * SPEED_UNIT,
        row[V_DOWN] * SPEED_UNIT,
    )
    # The autopilot counts from local north, or grid north near the poles.
    turned = wrap(turned - m.grid * lon)
    turning, m.turned = wrap(turned - m.turned), turned
    heading, bank = steer(m, (elements, points, crossed_s), trains, cycles, time_s, motion)
    # North turns too until the next tick.
    heading -= turned + turning
    before = targets[TO_HEADING, 0] if targets[TO_HEADING, 1] != 0.0 else heading
    count = move(targets, TO_HEADING, before + wrap(heading - before), which, values, 0)
    targets[TO_HEADING, 0] = heading % (2.0 * math.pi)
    count = move(targets, BANK, bank, which, values, count)
    count = move(targets, HOLD_HEADING, share_of(m.heading), which, values, count)
    count = move(targets, HOLD_YAW, share_of(m.yaw), which, values, count)
    count = move(targets, HOLD_HEIGHT, share_of(m.height), which, values, count)
    count = swings.cubics(swung, swung_cycles, swung_last, time_s, which, values, count, SWUNG)
    which[count], values[count] = AT, clock_s
    stuck = first_stuck(watched, row)
    told = STUCK if stuck >= 0 else 0
    told |= MISSED if m.crossed > 0 and is_missed(elements[m.index].turn, m.off_m, m.tolerance_m) else 0
    told |= BEFORE if m.crossed == 0 else 0
    told |= ENTERED if m.crossed > crossed else 0
    told |= FINISHED if open_end and not math.isnan(m.finished_s) else 0
    return told, stuck, count + 1, m.index, m.along_m, math.hypot(to_north, to_east)


@compiled
def move(targets: np.ndarray, number: int, target: float, which: np.ndarray, values: np.ndarray, count: int) -> int:
    """Move a set point from its last target to a new one within the next tick; nothing is written at rest."""
    before = targets[number, 0] if targets[number, 1] != 0.0 else target
    if targets[number, 1] == 1.0 and target == before:
        return count
    which[count], values[count] = number, before
    which[count + 1], values[count + 1] = number + len(targets), (target - before) * TICK_HZ
    targets[number, 0], targets[number, 1] = target, 1.0 if target == before else 2.0
    return count + 2
