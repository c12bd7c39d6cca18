"""Checks that end a flight in the air: controls at their stops, a leg that is missed.

They run ten times a second. A failure is reported with time and state; nothing is corrected.
"""

from magsim.aircraft.facts import Facts
from magsim.flight.model.channels import COLUMN, TO_SI
from magsim.flight.path.elements import Element
from magsim.scenario import FlightSettings

STOP_PART = 1e-3
"""A control within this part of its travel from a stop is at the stop."""

SPEED_PART = 0.03
"""An airspeed within this part of the commanded one is held."""

AIRSPEED = COLUMN["airspeed"]


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
    """

    def __init__(self, facts: Facts, settings: FlightSettings, speed_mps: float, tick_s: float) -> None:
        self._limit_m, self._tick_s = settings.leg_tolerance_m, tick_s
        controls = facts.controls
        travels = {name: getattr(controls, name).travel.value for name in ("elevator", "aileron", "rudder")}
        allowed = dict.fromkeys(travels, settings.surface_saturation_s) | {"throttle": settings.throttle_saturation_s}
        travels["throttle"] = (0.0, 1.0)
        self._checks = []
        for name, (low, high) in travels.items():
            # Bounds in the units of the plant's rows, so that a check converts nothing.
            index, margin = COLUMN[name], STOP_PART * (high - low)
            factor = float(TO_SI[index])
            self._checks.append((name, index, (low + margin) / factor, (high - margin) / factor, allowed[name]))
        speed = speed_mps / float(TO_SI[AIRSPEED])
        self._slow, self._fast = (1.0 - SPEED_PART) * speed, (1.0 + SPEED_PART) * speed
        self._ticks = [0] * len(self._checks)

    def controls(self, row: list[float]) -> str:
        """Describe what is wrong with the controls at a row of the plant; empty if nothing.

        Full or idle throttle is allowed as long as the airspeed is held.
        """
        ticks, slow, fast = self._ticks, self._slow, self._fast
        for i, (name, index, low, high, allowed_s) in enumerate(self._checks):
            if low < row[index] < high or (name == "throttle" and slow < row[AIRSPEED] < fast):
                ticks[i] = 0
                continue
            ticks[i] += 1
            if ticks[i] * self._tick_s > allowed_s:
                stop = "lower" if row[index] <= low else "upper"
                return f"was out of control: {name} at its {stop} stop for more than {allowed_s:g} s"
        return ""

    def line(self, element: Element, off_m: float) -> str:
        """Describe a distance from an element of the path, positive to the right, that is too large; empty if not."""
        if element.turn or abs(off_m) <= self._limit_m:
            return ""
        side = "right" if off_m > 0.0 else "left"
        return (
            f"missed leg {element.leg} of circuit {element.circuit}: {abs(off_m):.0f} m to the {side} of its line, "
            f"allowed {self._limit_m:g} m,"
        )
