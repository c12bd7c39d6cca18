"""Where a sensor can be mounted, and how that place gives way under load."""

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from magsim.aircraft.magnetics.base import Positive, Source, unit
from magsim.config import Strict, Vector


class FlexMode(Strict):
    """One way in which a mount gives: a mode of its boom, or a floor or bracket that follows the load."""

    direction: Vector = Field(description="unit vector: where the mount goes")
    compliance_mmpg: Positive | None = Field(
        default=None, description="way for each g, of what is far stiffer than a boom and does not swing"
    )
    frequency_hz: Positive | None = Field(default=None, description="natural frequency of a boom")
    damping: Annotated[float | None, Field(gt=0.0, lt=1.0, description="of a boom, over the critical one")] = None
    participation: Positive = Field(
        default=1.0, description="1: a mass at the end of a light boom; 1.566: the end of a uniform cantilever"
    )
    tilt_radpm: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="rotation vector of the mount for each meter it goes; 1.3765 / length: end of a uniform cantilever",
    )
    source: Source

    _direction = field_validator("direction")(unit)

    @model_validator(mode="after")
    def _one_kind(self) -> "FlexMode":
        boom = (self.frequency_hz, self.damping)
        swings = None not in boom and self.compliance_mmpg is None
        gives = boom == (None, None) and self.participation == 1.0 and self.compliance_mmpg is not None
        if not (swings or gives):
            msg = "allowed: frequency_hz with damping for a boom that swings, or compliance_mmpg without them"
            raise ValueError(msg)
        return self


class Mount(Strict):
    """A place for a sensor on the parked aircraft."""

    position_m: Vector
    flex: Annotated[tuple[FlexMode, ...], Field(strict=False, description="bends where field.flex is on")] = ()
    source: Source
