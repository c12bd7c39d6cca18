"""Permanent moments: fixed in the aircraft, or turning with a control surface."""

from typing import Literal

from pydantic import Field, field_validator

from magsim.aircraft.magnetics.base import Source, unit
from magsim.config import Name, Strict, Vector

SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")
"""Control surfaces that may carry a dipole."""

DIPOLE_CLEARANCE_M = 0.2
"""Least distance from a mount to a point dipole: about the size of a servo."""

Surface = Literal["elevator", "aileron_left", "aileron_right", "rudder", "flap"]


class Dipole(Strict):
    """A permanent magnetic moment.

    The moment is the effective one: what a survey of the parked aircraft would find for the part as installed,
    with what it induces in the iron next to it.
    """

    name: Name
    position_m: Vector
    moment_am2: Vector
    source: Source


class FixedDipole(Dipole):
    """A moment fixed in the aircraft. Not installed, it is the part's own, and magnetizes the steel beside it."""

    installed: bool = Field(default=True, description="the moment holds what the part induces in the steel beside it")


class HingedDipole(Dipole):
    """A permanent magnetic moment that turns with a control surface; position and moment at zero deflection.

    It is always an installed one: what it induces would change with every deflection.
    """

    surface: Surface
    hinge_point_m: Vector
    hinge_axis: Vector = Field(description="unit vector; positive deflection follows the right-hand rule")

    _axis = field_validator("hinge_axis")(unit)
