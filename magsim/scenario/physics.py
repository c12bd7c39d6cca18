"""The air, and which parts of the field are on."""

from typing import Literal

from pydantic import Field

from magsim.config import Strict


class Air(Strict):
    """Wind and turbulence."""

    wind_north_mps: float = Field(default=0.0, ge=-30.0, le=30.0, description="where the air moves to: north")
    wind_east_mps: float = Field(default=0.0, ge=-30.0, le=30.0, description="where the air moves to: east")
    turbulence_severity: int = Field(default=0, ge=0, le=7, description="MIL-F-8785C severity, Tustin form")


class Earth(Strict):
    """The main field."""

    model: Literal["igrf14"] = "igrf14"
    along_path: bool = Field(
        default=True, description="false: the field of the start point everywhere, without gradient"
    )


class Part(Strict):
    """A part of the aircraft's field that can be switched and scaled."""

    enabled: bool = True
    scale: float = Field(default=1.0, ge=-1000.0, le=1000.0)


class Eddy(Part):
    """Eddy currents."""

    lag: bool = Field(default=True, description="false: instantaneous, proportional to dB/dt (Tolles-Lawson)")


class Field_(Strict):
    """Which physics is on."""

    earth: Earth = Earth()
    permanent: Part = Part()
    hinged: Part = Part()
    induced: Part = Part()
    eddy: Eddy = Eddy()
