"""The guidance of a flight: where it is on its path, what it remembers, when it entered each element."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.aero import derivatives
from magsim.flight.path.elements import Element, tables_of
from magsim.flight.pilot.steering import MEMORY


class Crossing(NamedTuple):
    """The moment at which an element of the path was entered."""

    element: int
    """Its index in the path."""
    time_s: float


class Guidance:
    """Position along a path, and what is remembered from tick to tick; ``steering.steer`` steps it.

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

    Attributes
    ----------
    memory : (1,) of MEMORY
    elements, points : arrays
        The path, see ``tables_of``.
    crossed_s : (n,)
        When each element was entered.
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
        self.elements, self.points = tables_of(path)
        self.crossed_s = np.full(len(path), math.nan)
        self.memory = memory = np.zeros(1, MEMORY)
        known = {
            "course_gain": gains.course.value,
            "line_s": gains.line.value,
            "intercept": gains.intercept_limit.value,
            "lead_s": gains.bank_lag.value,
            "weathercock": _weathercock(facts),
            "most_bank": most_bank,
            "gusty": gusty,
            "along_m": along_m,
            "finished_s": math.nan,
            "heading": 1.0,
            "height": 1.0,
            "steady": float(gusty),
        }
        for name, value in known.items():
            memory[name] = value

    @property
    def off_m(self) -> float:
        """Distance from the path at the last tick, positive to the right [m]."""
        return float(self.memory["off_m"][0])

    @property
    def along_m(self) -> float:
        """Distance from the beginning of the element [m]."""
        return float(self.memory["along_m"][0])

    @property
    def index(self) -> int:
        """Number of the element of the path."""
        return int(self.memory["index"][0])

    @property
    def crossings(self) -> list[Crossing]:
        """The elements that have been entered, in order."""
        times = self.crossed_s[: int(self.memory["crossed"][0])]
        return [Crossing(number, time_s) for number, time_s in enumerate(times.tolist())]

    @property
    def finished_s(self) -> float | None:
        """When the end of the path was passed; None before."""
        finished_s = float(self.memory["finished_s"][0])
        return None if math.isnan(finished_s) else finished_s


def _weathercock(facts: Facts) -> float:
    """Return the heading error that the rudder holds, over the sideslip that causes it."""
    gains, effect = facts.autopilot, derivatives(facts)
    rudder = max(-facts.controls.rudder.travel.value[0], facts.controls.rudder.travel.value[1])
    return -effect.yaw_beta / (effect.yaw_rudder * rudder * gains.yaw_rate.value * gains.yaw.value)
