"""What tables of instruments share: a mount, a clock."""

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from magsim.config import Name, Strict, Vector
from magsim.scenario.base import NonNegative, aircraft_of, bird_of


def points_somewhere(value: Vector | None) -> Vector | None:
    """Return a direction; raise ValueError where it has no length."""
    if value is not None and not any(value):
        msg = "(0, 0, 0) points nowhere; allowed: a direction of any length but 0"
        raise ValueError(msg)
    return value


class Sensor(Strict):
    """An instrument with a name of its own at a mount of the aircraft, or of the bird that it tows."""

    name: Name
    body: Literal["carrier", "bird"] = Field(default="carrier", description="what carries it")
    mount: str

    @field_validator("mount")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        vehicle = bird_of(info) if info.data.get("body") == "bird" else aircraft_of(info)
        if vehicle and value not in vehicle.mounts:
            known = ", ".join(vehicle.mounts)
            msg = f"{vehicle.name} has no mount {value!r}; allowed: {known}"
            raise ValueError(msg)
        return value


class InstrumentClock(Strict):
    """When the values of a row were taken: ``t - skew_s - drift_ppm 1e-6 t - jitter`` for the tag ``t``."""

    skew_s: float = Field(default=0.0, ge=-0.5, le=0.5, description="how late the reading is; labels are at the tag")
    jitter_s: NonNegative = Field(default=0.0, le=0.02, description="standard deviation, white from row to row")
    drift_ppm: float = Field(default=0.0, ge=-200.0, le=200.0, description="growth of the lateness, microseconds a s")
