"""A tick of the guidance, compiled: a row of the plant becomes the set points that the autopilot moves to."""

import math

import numpy as np

from magsim.flight.model.autopilot import RAMPED, rate_of
from magsim.flight.model.channels import CHANNELS, COLUMN, MOTION
from magsim.flight.path.plane import motion_in_plane
from magsim.flight.pilot.monitor import first_stuck
from magsim.flight.pilot.steering import TICK_HZ, share_of, steer, wrap
from magsim.storage.compiled import compiled

ORDERS = (*RAMPED, *map(rate_of, RAMPED))
"""The properties of set points and their rates."""

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
    targets: np.ndarray,
    watched: np.ndarray,
    rows: np.ndarray,
    last: int,
    time_s: float,
    which: np.ndarray,
    values: np.ndarray,
) -> tuple[int, int, int, float, int, float, float, float]:
    """Steer, and write what the set points do until the next tick.

    Parameters
    ----------
    memory : (1,) of steering.MEMORY
    elements, points, crossed_s : arrays
        As in ``Guidance``.
    plane : (10,)
        ``LocalPlane.table``.
    trains, cycles : arrays
        Trains that are flown, from ``cycles.table_of``.
    targets : (7, 2)
        Where each of ``RAMPED`` is going; 0 while it has not been set, 1 at rest, 2 moving.
    watched : (k,) of monitor.WATCHED
        Controls that end the flight where they are stuck.
    rows : (n, c)
        Of the plant, in its units.
    last : int
        Number of the last one.
    time_s : float
    which, values : (14,)
        Get numbers and values of ``ORDERS``.

    Returns
    -------
    count : int
        Of the orders.
    stuck : int
        Number of a control that has been at its stop for too long, -1 if none has.
    crossed : int
        Number of elements that have been entered.
    finished_s : float
        When the end of the path was passed, NaN before.
    index, along_m, off_m : int, float, float
        Place on the path.
    speed : float [m/s]
        Over ground, in the plane.
    """
    m, row = memory[0], rows[last]
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
    return (
        count,
        first_stuck(watched, row),
        m.crossed,
        m.finished_s,
        m.index,
        m.along_m,
        m.off_m,
        math.hypot(to_north, to_east),
    )


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
