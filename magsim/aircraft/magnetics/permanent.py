"""Permanent moments: fixed in the aircraft, or turning with a control surface."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator

from magsim.aircraft.magnetics.base import Hangs, NonNegative, Positive, Source, as_tuple, unit
from magsim.config import Name, Strict, Vector

SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")
"""Control surfaces that may carry a dipole."""

DIPOLE_CLEARANCE_M = 0.2
"""Least distance from a mount to a point dipole: about the size of a servo."""

Surface = Literal["elevator", "aileron_left", "aileron_right", "rudder", "flap"]

Seated = Annotated[bool, Field(description="a person, who moves in the seat during a flight")]


class Dipole(Strict):
    """A permanent magnetic moment.

    The moment is the effective one: what a survey of the parked aircraft would find for the part as installed,
    with what it induces in the iron next to it.
    """

    name: Name
    position_m: Vector
    moment_am2: Vector
    kind: Literal["fitting", "machine"] = Field(
        default="fitting",
        description="machine: an engine or motor, alike in all aircraft of a type; fitting: remanence of small steel "
        "parts, which is chance",
    )
    magnet: Literal["ferrite", "alnico", "ndfeb"] | None = Field(
        default=None, description="whose moment it is, for its change with temperature; without it, steel"
    )
    source: Source


class FixedDipole(Dipole):
    """A moment fixed in the aircraft. Not installed, it is the part's own, and magnetizes the steel beside it."""

    installed: bool = Field(default=True, description="the moment holds what the part induces in the steel beside it")
    notch_m: Vector | None = Field(
        default=None, description="of a part that moves with a seat: from one notch of its rail to the next"
    )
    suspension: Hangs = None
    seated: Seated = False


class Carried(Strict):
    """A person or a case that comes aboard for a day: where it may be, and how magnetic it is."""

    name: Name
    center_m: Vector
    size_m: Annotated[tuple[Positive, Positive, Positive], BeforeValidator(as_tuple)] = Field(
        description="of the box around the center in which it may be: forward, right, down"
    )
    moment_am2: Annotated[tuple[NonNegative, NonNegative], BeforeValidator(as_tuple)] = Field(
        description="least and largest, in any direction"
    )
    seated: Seated = False
    source: Source

    @field_validator("moment_am2")
    @classmethod
    def _ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] <= value[1]:
            msg = f"{list(value)} is no range; allowed: [least, largest]"
            raise ValueError(msg)
        return value


class HingedDipole(Dipole):
    """A permanent magnetic moment that turns with a control surface; position and moment at zero deflection.

    It is always an installed one: what it induces would change with every deflection.
    """

    surface: Surface
    hinge_point_m: Vector
    hinge_axis: Vector = Field(description="unit vector; positive deflection follows the right-hand rule")

    _axis = field_validator("hinge_axis")(unit)
