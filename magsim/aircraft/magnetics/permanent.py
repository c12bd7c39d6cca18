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
    """A permanent magnetic moment fixed in the aircraft.

    Installed, the moment is the effective one: what a survey of the parked aircraft would find for the part, with what
    it induces in the iron next to it. Otherwise it is the part's own, and the steel beside it is magnetized by it.
    """

    name: Name
    position_m: Vector
    moment_am2: Vector
    installed: bool = Field(default=True, description="the moment holds what the part induces in the steel beside it")
    source: Source


class HingedDipole(Dipole):
    """A permanent magnetic moment that turns with a control surface; position and moment at zero deflection.

    It is always an installed one: what it induces would change with every deflection.
    """

    installed: Literal[True] = True
    surface: Surface
    hinge_point_m: Vector
    hinge_axis: Vector = Field(description="unit vector; positive deflection follows the right-hand rule")

    _axis = field_validator("hinge_axis")(unit)
