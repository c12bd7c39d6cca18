"""Types and helpers that the models of a scenario share."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field, ValidationInfo, model_validator

from magsim.aircraft import Aircraft, Bird
from magsim.config import Strict

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]


class PresetTable(Strict):
    """A table whose ``preset`` names values for the keys that it leaves out."""

    PRESETS: ClassVar[Mapping[str, Mapping[str, object]]] = {}

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, value: object) -> object:
        if isinstance(value, Mapping) and isinstance(value.get("preset"), str):
            return {**cls.PRESETS.get(value["preset"], {}), **value}
        return value


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
