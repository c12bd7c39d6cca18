"""Types and helpers that the models of a scenario share."""

from typing import Annotated

from pydantic import Field, ValidationInfo

from magsim.aircraft import Aircraft, Bird
from magsim.config import Strict

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]


class FieldPart(Strict):
    """A part of the aircraft's field that can be switched and scaled."""

    enabled: bool = True
    scale: float = Field(default=1.0, ge=-1000.0, le=1000.0)


def aircraft_of(info: ValidationInfo) -> Aircraft | None:
    """Return the aircraft that a scenario is checked against, if it is known."""
    return (info.context or {}).get("aircraft")


def bird_of(info: ValidationInfo) -> Bird | None:
    """Return the bird that a scenario is checked against, if one is towed and known."""
    return (info.context or {}).get("bird")
