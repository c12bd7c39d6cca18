"""Which parts of the field are on."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator

from magsim.aircraft.magnetics import Surface
from magsim.config import Problems, Strict
from magsim.scenario.base import FieldPart, NonNegative, aircraft_of
from magsim.scenario.electronics import Electronics
from magsim.scenario.geology import Crust, Target
from magsim.scenario.swell import Swell
from magsim.scenario.variation import Variation


class Departure(Strict):
    """What the main field has and its model has not: waves of 5 to 500 km, and a vector that changes over hours."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"seed": ("scale",)}

    enabled: bool | None = Field(default=None, description="left out: on, unless the field is without gradient")
    scale: NonNegative = Field(default=1.0, le=100.0, description="1: the error that WMM2025 states for itself")
    seed: int = Field(
        default=0,
        ge=0,
        lt=2**63,
        description="of the world, not of the flight: flights that share it meet the same field",
    )


class Earth(Strict):
    """The main field."""

    model: Literal["igrf14"] = "igrf14"
    along_path: bool = Field(
        default=True, description="false: the field of the start point everywhere, without gradient"
    )
    departure: Departure = Field(
        default=Departure(), description="from the model, along the path; a field without gradient has none"
    )

    @field_validator("departure")
    @classmethod
    def _along_path(cls, value: Departure, info: ValidationInfo) -> Departure:
        if info.data.get("along_path") is False:
            for key, asked in (("enabled", value.enabled), ("scale", value.scale != 1.0), ("seed", value.seed != 0)):
                if asked:
                    setting = "enabled = true" if key == "enabled" else f"{getattr(value, key):g}"
                    msg = f"{setting} has no effect with along_path = false"
                    raise Problems((key, f"{msg}; allowed: along_path = true, or without this key"))
        return value

    @property
    def departs(self) -> bool:
        """Whether the field departs from its model; one without gradient does not."""
        return self.along_path and self.departure.enabled is not False

    @property
    def description(self) -> str:
        """What the main field of a recording is, in words."""
        if not self.along_path:
            return "IGRF-14 of the start point everywhere, without gradient and without departure from the model"
        if not self.departs:
            return "IGRF-14, without departure from the model"
        times = "" if self.departure.scale == 1.0 else f" times {self.departure.scale:g}"
        return f"IGRF-14 with the departure of world {self.departure.seed}{times}"


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

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"start": ("hysteresis", "viscosity")}

    hysteresis: bool = True
    viscosity: bool = True
    start: Literal["settled", "aligned", "demagnetized"] = Field(
        default="settled",
        description="before the first row: the same flight had been flown, the first field was held, or no field was",
    )


class MovingPart(FieldPart):
    """The field of what moves in flight; its sizes are estimates, so that a scenario asks for it."""

    enabled: bool = False


class Temperature(Strict):
    """Of the air at the height flown, on magnets and metal."""

    enabled: bool = Field(default=True, description="false: that of the start's height, all along the flight")


class FlexPart(Strict):
    """Bending of the mounts under load, in the ways that the aircraft file gives."""

    enabled: bool = False
    scale: float = Field(default=1.0, ge=0.0, le=1000.0)


class FieldSettings(Strict):
    """Which physics is on."""

    earth: Earth = Earth()
    crust: Crust | None = Field(default=None, description="random geology")
    targets: tuple[Target, ...] = Field(default=(), strict=False, max_length=200, description="bodies in the ground")
    variation: Variation | None = Field(default=None, description="daily variation, pulsations, drift")
    swell: Swell | None = Field(default=None, description="waves of the sea below a low flight")
    permanent: FieldPart = FieldPart()
    hinged: HingedPart = HingedPart()
    controls: MovingPart = Field(default=MovingPart(), description="steel of yoke, pedals and cables")
    suspension: MovingPart = Field(default=MovingPart(), description="what hangs on rubber mounts, as it gives way")
    crew: FieldPart = Field(default=FieldPart(), description="people who move in their seats; aboard on a day")
    propeller: FieldPart = FieldPart()
    induced: FieldPart = FieldPart()
    memory: MemoryPart = MemoryPart()
    eddy: EddyPart = EddyPart()
    temperature: Temperature = Field(default=Temperature(), description="along the flight, on a day")
    flex: FlexPart = FlexPart()
    electronics: Electronics = Electronics()
    carrier: FieldPart = Field(default=FieldPart(), description="of a carrier, in the bird that it tows")

    def is_on(self, name: str) -> bool:
        """Whether the part of that name is switched on; the main field always is."""
        if name == "departure":
            return self.earth.departs
        if name in {"earth", "target"}:
            return name == "earth" or bool(self.targets)
        part = getattr(self, name)
        return part is not None and part.enabled
