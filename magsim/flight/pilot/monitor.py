"""Checks that end a flight in the air: controls at their stops, a leg that is missed.

They run ten times a second. A failure is reported with time and state; nothing is corrected.
"""

import math
from collections.abc import Sequence

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.channels import COLUMN, TO_SI
from magsim.flight.path.elements import Element
from magsim.scenario import FlightSettings
from magsim.storage.compiled import compiled

STOP_PART = 1e-3
"""A control within this part of its travel from a stop is at the stop."""

SPEED_PART = 0.03
"""An airspeed within this part of the commanded one is held."""

AIRSPEED = COLUMN["airspeed"]

CONTROLS = ("elevator", "aileron", "rudder", "throttle")

WATCHED = np.dtype(
    [
        ("index", "i8"),
        ("low", "f8"),
        ("high", "f8"),
        ("slow", "f8"),
        ("fast", "f8"),
        ("tick_s", "f8"),
        ("allowed_s", "f8"),
        ("ticks", "i8"),
    ]
)
"""A control: its column, between which values it is free, airspeeds between which it may be at a stop, and for how long
it has been at one."""


class FlightMonitor:
    """Checks controls and the distance from the line.

    Parameters
    ----------
    facts : Facts
    settings : FlightSettings
        Limits of distance and time.
    speed_mps : float
        Commanded airspeed.
    tick_s : float
        Time between two checks.

    Attributes
    ----------
    watched : (4,) of WATCHED
        The controls.
    tolerance_m : float
        Largest distance from a leg's line.
    """

    def __init__(self, facts: Facts, settings: FlightSettings, speed_mps: float, tick_s: float) -> None:
        self.tolerance_m = settings.leg_tolerance_m
        controls = facts.controls
        travels = {name: getattr(controls, name).travel.value for name in CONTROLS[:-1]} | {"throttle": (0.0, 1.0)}
        self.watched = np.zeros(len(CONTROLS), WATCHED)
        speed = speed_mps / float(TO_SI[AIRSPEED])
        for number, name in enumerate(CONTROLS):
            (low, high), throttle = travels[name], name == "throttle"
            # Bounds in the units of the plant's rows, so that a check converts nothing.
            index, margin = COLUMN[name], STOP_PART * (high - low)
            factor = float(TO_SI[index])
            allowed_s = settings.throttle_saturation_s if throttle else settings.surface_saturation_s
            held = ((1.0 - SPEED_PART) * speed, (1.0 + SPEED_PART) * speed) if throttle else (math.inf, -math.inf)
            bounds = ((low + margin) / factor, (high - margin) / factor)
            self.watched[number] = (index, *bounds, *held, tick_s, allowed_s, 0)

    def controls(self, row: Sequence[float]) -> str:
        """Describe what is wrong with the controls at a row of the plant; empty if nothing.

        Full or idle throttle is allowed as long as the airspeed is held.
        """
        number = first_stuck(self.watched, np.array(row))
        return "" if number < 0 else self.stuck(number, row)

    def stuck(self, number: int, row: Sequence[float]) -> str:
        """Describe the control, by its number, that has been at a stop for too long at a row of the plant."""
        control = self.watched[number]
        stop = "lower" if row[control["index"]] <= control["low"] else "upper"
        return f"was out of control: {CONTROLS[number]} at its {stop} stop for more than {control['allowed_s']:g} s"

    def line(self, element: Element, off_m: float) -> str:
        """Describe a distance from an element of the path, positive to the right, that is too large; empty if not."""
        if not is_missed(element.turn, off_m, self.tolerance_m):
            return ""
        side = "right" if off_m > 0.0 else "left"
        return (
            f"missed leg {element.leg} of circuit {element.circuit}: {abs(off_m):.0f} m to the {side} of its line, "
            f"allowed {self.tolerance_m:g} m,"
        )


@compiled
def first_stuck(watched: np.ndarray, row: np.ndarray) -> int:
    """Count the ticks that each control has been at a stop; return the number of one that has been too long, or -1.

    Parameters
    ----------
    watched : (n,) of WATCHED
    row : (c,)
        Of the plant, in its units.
    """
    for number in range(len(watched)):
        control = watched[number]
        free = control.low < row[control.index] < control.high
        if free or control.slow < row[AIRSPEED] < control.fast:
            control.ticks = 0
            continue
        control.ticks += 1
        if control.ticks * control.tick_s > control.allowed_s:
            return number
    return -1


@compiled
def is_missed(turn: bool, off_m: float, tolerance_m: float) -> bool:
    """Whether a distance from an element of the path is too large; in a turn any is allowed."""
    return not (turn or abs(off_m) <= tolerance_m)
