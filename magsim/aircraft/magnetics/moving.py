"""What moves in flight: steel of the controls, and what hangs on rubber mounts."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from magsim.aircraft.magnetics.base import Source, unit
from magsim.aircraft.magnetics.permanent import Dipole, FixedDipole, Surface
from magsim.aircraft.magnetics.rotors import RotatingDipole
from magsim.aircraft.magnetics.steel import SteelPart
from magsim.config import Strict, Vector


class ControlDipole(Dipole):
    """A moment on a yoke, a pedal or a cable, which goes and turns with a surface; place and moment at zero deflection.

    The controls are linked to their surfaces by cables or rods, so that they move whoever steers.
    """

    surface: Surface
    travel_mmpdeg: Vector = Field(
        default=(0.0, 0.0, 0.0), description="how far it goes, along x, y, z, for each degree of the surface"
    )
    turn_degpdeg: float = Field(default=0.0, description="by how much it turns for each degree of the surface")
    turn_point_m: Vector | None = Field(default=None, description="a point of the axis about which it turns")
    turn_axis: Vector | None = Field(default=None, description="unit vector; turning follows the right-hand rule")

    @field_validator("turn_axis")
    @classmethod
    def _axis(cls, value: Vector | None) -> Vector | None:
        return None if value is None else unit(value)

    @model_validator(mode="after")
    def _moves(self) -> "ControlDipole":
        turns = self.turn_degpdeg != 0.0
        if turns != (self.turn_point_m is not None) or turns != (self.turn_axis is not None):
            msg = f"{self.name}: allowed: turn_degpdeg, turn_point_m and turn_axis together, or none of them"
            raise ValueError(msg)
        if not turns and not any(self.travel_mmpdeg):
            msg = f"{self.name} does not move; allowed: travel_mmpdeg, turn_degpdeg, or both"
            raise ValueError(msg)
        return self


class Suspension(Strict):
    """Rubber mounts: what hangs on them gives way under load. The parked aircraft's weight has bent them already."""

    position_m: Vector = Field(description="center of gravity of what hangs there")
    compliance_mmpg: Annotated[Vector, Field(description="way along x, y, z for each g along them")]
    source: Source

    @field_validator("compliance_mmpg")
    @classmethod
    def _gives(cls, value: Vector) -> Vector:
        if min(value) < 0.0 or not any(value):
            msg = f"{list(value)}: allowed: three values, none below 0 and one above"
            raise ValueError(msg)
        return value


def check_suspensions(
    suspensions: Mapping[str, Suspension], what: str, parts: Sequence[FixedDipole | RotatingDipole | SteelPart]
) -> None:
    """Check that every part that hangs on rubber mounts names some of the file.

    Parameters
    ----------
    suspensions : mapping of str to Suspension
    what : str
        The word for such a part.
    parts : sequence

    Raises
    ------
    ValueError
        If one names others.
    """
    for part in parts:
        if part.suspension is not None and part.suspension not in suspensions:
            msg = f"{what} {part.name!r} hangs on {part.suspension!r}; allowed: {', '.join(suspensions) or 'none'}"
            raise ValueError(msg)
