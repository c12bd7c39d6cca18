"""A carrier without a flight model: the models of its ``facts.toml``.

Its path is given, its attitude follows from path and speed; no force acts on it. Its recordings state that it is
kinematic.
"""

from functools import cached_property
from typing import Annotated, Literal

from pydantic import AfterValidator

from magsim.aircraft.fact import Area, Degrees, Duration, Envelope, Length, Mass, Position, RangeFact, Speed, in_unit
from magsim.config import Strict

FrequencyRange = Annotated[RangeFact, AfterValidator(in_unit("Hz"))]


class KinematicDatum(Strict):
    """Origin of body coordinates."""

    description: str


class KinematicLimits(Envelope):
    """Limits of the carrier."""

    @cached_property
    def amplitude_deg(self) -> dict[str, float]:
        """No maneuvers: nothing swings it."""
        return dict.fromkeys(("pitch", "roll", "yaw"), 0.0)


class SwayFacts(Strict):
    """How air and hands move it: standard deviations, and the band in which the bank's power is even."""

    lateral: Length
    vertical: Length
    along: Length
    heading: Degrees
    band: FrequencyRange


class KinematicFacts(Strict):
    """A carrier whose motion is prescribed."""

    kind: Literal["kinematic"]
    title: str
    datum: KinematicDatum
    mass: Mass
    drag_area: Area
    center_of_gravity: Position
    hook: Position
    bank_ease: Duration
    climb_limit: Speed
    sway: SwayFacts
    limits: KinematicLimits

    @property
    def cg_b(self) -> tuple[float, float, float]:
        """Center of gravity in body axes from the datum, (3,) [m]."""
        return self.center_of_gravity.value

    @property
    def hook_b(self) -> tuple[float, float, float]:
        """Where a rope is tied, body axes from the datum, (3,) [m]."""
        return self.hook.value

    @property
    def bank_ease_s(self) -> float:
        """Time for a turn's bank to be taken up [s]."""
        return self.bank_ease.value

    @property
    def climb_mps(self) -> float:
        """Steepest climb and descent [m/s]."""
        return self.climb_limit.value

    @property
    def flap(self) -> None:
        """No flaps."""
        return

    def loaded(self, payload_kg: float | None, fuel_kg: float | None, payload_aft_m: float) -> "KinematicFacts":
        """Return the same facts: a carrier without a flight model takes no load.

        Raises
        ------
        ValueError
            If a load is asked.
        """
        if payload_kg is not None or fuel_kg is not None or payload_aft_m:
            msg = "no load changes the motion of a kinematic carrier; allowed: no table [loading]"
            raise ValueError(msg)
        return self
