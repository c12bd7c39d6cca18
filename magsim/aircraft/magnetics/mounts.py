"""Where a sensor can be mounted, and how that place gives way under load."""

from typing import Annotated

from pydantic import Field, field_validator

from magsim.aircraft.magnetics.base import Positive, Source, unit
from magsim.config import Strict, Vector


class FlexMode(Strict):
    """One mode of bending of the boom or bracket that carries a mount, by its effect at the mount."""

    direction: Vector = Field(description="unit vector: where the mount goes")
    frequency_hz: Positive
    damping: Annotated[float, Field(gt=0.0, lt=1.0, description="over the critical one")]
    participation: Positive = Field(
        default=1.0, description="1: a mass at the end of a light boom; 1.566: the end of a uniform cantilever"
    )
    tilt_radpm: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="rotation vector of the mount for each meter it goes; 1.3765 / length: end of a uniform cantilever",
    )
    source: Source

    _direction = field_validator("direction")(unit)


class Mount(Strict):
    """A place for a sensor on the parked aircraft."""

    position_m: Vector
    flex: Annotated[tuple[FlexMode, ...], Field(strict=False, description="bends where field.flex is on")] = ()
    source: Source
