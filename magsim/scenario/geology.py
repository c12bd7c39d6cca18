"""Magnetic sources in the ground: the crust's random field, and bodies at known places."""

from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator, model_validator

from magsim.config import Name, Strict, Vector
from magsim.scenario.base import NonNegative, Positive
from magsim.scenario.place import WAYS_TO_GIVE, GroundPoint


class Crust(Strict):
    """The crustal field: random, exactly a potential field."""

    enabled: bool = True
    rms_nt: Positive = Field(
        default=60.0, le=5000.0, description="root mean square of the vertical component on the plane h = 0"
    )
    depth_m: NonNegative = Field(default=100.0, le=20_000.0, description="depth of the sources below the plane h = 0")
    plane_m: float | None = Field(
        default=None,
        ge=-500.0,
        le=9000.0,
        description="height of the plane h = 0 above the ellipsoid; without it the ground at the start point",
    )
    shortest_m: float | None = Field(
        default=None, ge=1.0, description="shortest wavelength; without it the slowest speed over 0.6 Hz"
    )
    longest_m: float = Field(default=50_000.0, ge=1000.0, le=500_000.0, description="longest wavelength")
    exponent: float = Field(
        default=3.0, ge=0.0, le=6.0, description="power density of the sources ~ wavenumber^-exponent"
    )
    modes: int = Field(default=256, ge=16, le=4096, description="number of plane waves")
    allow_smooth: bool = Field(default=False, description="let shortest_m leave the compensation band without geology")
    seed: int | None = Field(
        default=None, ge=0, lt=2**63, description="of the crust alone; without it the scenario's seed"
    )

    @field_validator("longest_m")
    @classmethod
    def _longer(cls, value: float, info: ValidationInfo) -> float:
        shortest = info.data.get("shortest_m")
        if shortest is not None and value <= shortest:
            msg = f"{value:g} is not above shortest_m = {shortest:g}; allowed: above that, to 500000"
            raise ValueError(msg)
        return value


class BuriedBody(GroundPoint):
    """A magnetic body in the ground."""

    name: Name
    depth_m: float = Field(ge=-100.0, le=20_000.0, description="of its center below the ground; negative is above it")

    @model_validator(mode="after")
    def _somewhere(self) -> "BuriedBody":
        if not self.given:
            msg = f"has no place; allowed: {WAYS_TO_GIVE}"
            raise ValueError(msg)
        return self


class DipoleTarget(BuriedBody):
    """A body so small that its place is a point."""

    kind: Literal["dipole"] = "dipole"
    moment_am2: Vector = Field(description="magnetic moment, north, east, down")


class MagnetizedBody(BuriedBody):
    """A body of rock."""

    susceptibility: float = Field(default=0.0, ge=0.0, le=20.0, description="volume, SI; in the main field there")
    remanence_apm: Vector = Field(default=(0.0, 0.0, 0.0), description="remanent magnetization, north, east, down")

    @model_validator(mode="after")
    def _magnetic(self) -> "MagnetizedBody":
        if self.susceptibility == 0.0 and not any(self.remanence_apm):
            msg = f"{self.name} is not magnetic; allowed: a susceptibility above 0, a remanence_apm, or both"
            raise ValueError(msg)
        return self


class SphereTarget(MagnetizedBody):
    """A sphere: outside, exactly a dipole."""

    kind: Literal["sphere"] = "sphere"
    radius_m: Positive = Field(le=5000.0)


class PrismTarget(MagnetizedBody):
    """A rectangular prism with a level top, magnetized uniformly."""

    kind: Literal["prism"] = "prism"
    susceptibility: float = Field(
        default=0.0, ge=0.0, le=1.0, description="volume, SI; in the main field there, without demagnetization"
    )
    length_m: Positive = Field(le=50_000.0, description="along its heading")
    width_m: Positive = Field(le=50_000.0, description="across it")
    height_m: Positive = Field(le=20_000.0, description="from bottom to top")
    heading_deg: float = Field(default=0.0, ge=0.0, lt=360.0, description="of its length, clockwise from north")


Target = Annotated[DipoleTarget | SphereTarget | PrismTarget, Discriminator("kind")]
