"""Which parts of the field are on."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from magsim.aircraft.magnetics import Surface
from magsim.config import Strict
from magsim.scenario.base import FieldPart, aircraft_of
from magsim.scenario.electronics import Electronics
from magsim.scenario.geology import Crust, Target
from magsim.scenario.variation import Variation


class Earth(Strict):
    """The main field."""

    model: Literal["igrf14"] = "igrf14"
    along_path: bool = Field(
        default=True, description="false: the field of the start point everywhere, without gradient"
    )


class EddyPart(FieldPart):
    """Eddy currents."""

    model: Literal["skin", "coils"] | None = Field(
        default=None, description="the whole skin or loops of wire; left out: what the aircraft's file gives"
    )
    lag: bool = Field(default=True, description="false: instantaneous, proportional to dB/dt (Tolles-Lawson)")

    @field_validator("model")
    @classmethod
    def _exists(cls, value: str | None, info: ValidationInfo) -> str | None:
        aircraft = aircraft_of(info)
        if value == "skin" and aircraft and aircraft.magnetics.skin is None:
            msg = f"{aircraft.name} has no [skin] in its magnetics.toml; allowed: 'coils'"
            raise ValueError(msg)
        return value


class HingedPart(FieldPart):
    """Moments that turn with control surfaces."""

    at_rest: Annotated[tuple[Surface, ...], Field(strict=False)] = Field(
        default=(), description="surfaces that stay at zero where the flight does not give their deflection"
    )


class MemoryPart(FieldPart):
    """Hysteresis and viscosity of the steel."""

    hysteresis: bool = True
    viscosity: bool = True
    start: Literal["settled", "aligned", "demagnetized"] = Field(
        default="settled",
        description="before the first row: the same flight had been flown, the first field was held, or no field was",
    )


class FlexPart(Strict):
    """Bending of the mounts, in the modes that the aircraft file gives."""

    enabled: bool = False
    scale: float = Field(default=1.0, ge=0.0, le=1000.0)


class FieldSettings(Strict):
    """Which physics is on."""

    earth: Earth = Earth()
    crust: Crust | None = Field(default=None, description="random geology")
    targets: tuple[Target, ...] = Field(default=(), strict=False, max_length=200, description="bodies in the ground")
    variation: Variation | None = Field(default=None, description="daily variation, pulsations, drift")
    permanent: FieldPart = FieldPart()
    hinged: HingedPart = HingedPart()
    propeller: FieldPart = FieldPart()
    induced: FieldPart = FieldPart()
    memory: MemoryPart = MemoryPart()
    eddy: EddyPart = EddyPart()
    flex: FlexPart = FlexPart()
    electronics: Electronics = Electronics()
    carrier: FieldPart = Field(default=FieldPart(), description="of a carrier, in the bird that it tows")

    def is_on(self, name: str) -> bool:
        """Whether the part of that name is switched on; the main field always is."""
        if name in {"earth", "target"}:
            return name == "earth" or bool(self.targets)
        part = getattr(self, name)
        return part is not None and part.enabled
