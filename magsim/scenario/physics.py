"""Which parts of the field are on."""

from typing import Literal

from pydantic import Field

from magsim.config import Strict


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

    def is_on(self, name: str) -> bool:
        """Whether the part of that name is switched on; the main field always is."""
        return name == "earth" or getattr(self, name).enabled
