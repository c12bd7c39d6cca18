"""Flaps that move in flight: when, and how far."""

import math

from pydantic import Field, model_validator

from magsim.aircraft import Aircraft
from magsim.config import Strict
from magsim.earth.atmosphere import standard_density
from magsim.scenario.base import NonNegative
from magsim.units import RHO0


class FlapMove(Strict):
    """A setting of the flap lever; the motor then takes its time."""

    deflection_deg: float = Field(ge=0.0, le=90.0, description="where the flaps go")
    at_s: NonNegative | None = Field(default=None, description="when, counted from the first row; or name a leg")
    leg: int | None = Field(default=None, ge=1, description="when this leg is entered; or name a time by at_s")
    circuit: int = Field(default=1, ge=1, description="of the leg")
    after_s: NonNegative = Field(default=0.0, description="so much later than the leg is entered")

    @model_validator(mode="after")
    def _one_moment(self) -> "FlapMove":
        if (self.at_s is None) == (self.leg is None):
            msg = "a flap move has one moment; allowed: either at_s, or leg (with circuit and after_s)"
            raise ValueError(msg)
        if self.leg is None and {"circuit", "after_s"} & self.model_fields_set:
            msg = "circuit and after_s belong to a leg; allowed: with leg, or at_s alone"
            raise ValueError(msg)
        return self

    def __str__(self) -> str:
        when = f"{self.at_s:g} s" if self.leg is None else f"leg {self.leg} of circuit {self.circuit}"
        return f"{self.deflection_deg:g} deg at {when}" + (f" and {self.after_s:g} s" if self.after_s else "")


def flap_problem(aircraft: Aircraft, flap_deg: float, speed_mps: float | None, alt_m: float | None) -> str:
    """Return the problem of flaps at a true airspeed and a height, or an empty text; unknown speeds are not checked."""
    flap = aircraft.facts.flap
    if flap is None:
        return f"{aircraft.name} has no flaps; allowed: 0" if flap_deg else ""
    most = math.degrees(flap.travel.value[1])
    if flap_deg > most + 1e-3:
        return f"{flap_deg:g} is beyond the travel of {aircraft.name}; allowed: 0 to {most:.0f}"
    if flap_deg == 0.0 or speed_mps is None or alt_m is None:
        return ""
    indicated = speed_mps * math.sqrt(standard_density(alt_m) / RHO0)
    limits = zip(flap.speed_limit.at, flap.speed_limit.value, strict=True)
    limit = next(v for at, v in limits if flap_deg <= at + 1e-3)
    if indicated <= limit:
        return ""
    return (
        f"{flap_deg:g} deg of flap at {speed_mps:g} m/s, {indicated:.1f} m/s indicated; allowed at this deflection: "
        f"up to {limit:g} indicated"
    )
