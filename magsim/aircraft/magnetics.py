"""What ``magnetics.toml`` of an aircraft may say: mounts, permanent moments, steel parts, loops.

All places are in meters in body axes (forward, right, down) from the aircraft's datum. Each group of numbers
carries a ``source``: where it was read, or ``estimate: ...`` with the published level that set it.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BeforeValidator, Discriminator, Field, field_validator, model_validator

from magsim.config import Name, Strict, Vector

SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")
"""Control surfaces that may carry a dipole."""

DIPOLE_CLEARANCE_M = 0.2
"""Least distance from a mount to a point dipole: about the size of a servo."""

Surface = Literal["elevator", "aileron_left", "aileron_right", "rudder", "flap"]
Positive = Annotated[float, Field(gt=0.0)]
Source = Annotated[str, Field(min_length=4, description="where the numbers come from, or 'estimate: ...'")]
Permeability = Annotated[float, Field(gt=1.0, le=1e6, description="relative permeability")]
Count = Annotated[int, Field(ge=1, le=64)]


def _unit(value: Vector) -> Vector:
    length = math.hypot(*value)
    if not abs(length - 1.0) < 1e-6:
        msg = f"has length {length:.6g}; allowed: a unit vector"
        raise ValueError(msg)
    return value


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Vertices = Annotated[tuple[Vector, ...], BeforeValidator(_as_tuple), Field(min_length=3)]


class Mount(Strict):
    """A place for a sensor."""

    position_m: Vector
    source: Source


class Dipole(Strict):
    """A permanent magnetic moment fixed in the aircraft.

    The moment is the effective one: what a survey of the parked aircraft would find for the part as installed,
    with what it induces in the iron next to it.
    """

    name: Name
    position_m: Vector
    moment_am2: Vector
    source: Source


class HingedDipole(Dipole):
    """A permanent magnetic moment that turns with a control surface; position and moment at zero deflection."""

    surface: Surface
    hinge_point_m: Vector
    hinge_axis: Vector = Field(description="unit vector; positive deflection follows the right-hand rule")

    _axis = field_validator("hinge_axis")(_unit)


class SteelPart(Strict):
    """What every soft-magnetic part has."""

    name: Name
    center_m: Vector
    mu_r: Permeability
    source: Source


class BoxSheet(SteelPart):
    """Closed box of thin steel sheet."""

    kind: Literal["box_sheet"]
    size_m: Vector
    thickness_m: Positive
    element_m: Positive = Field(description="largest edge of the mesh along the sides of the box")

    @property
    def element_size_m(self) -> float:
        """Longest edge of the mesh [m]."""
        return self.element_m

    def clearance_m(self, place: Vector) -> float:
        """Distance from a place to the nearest wall [m]."""
        beyond = [abs(x - c) - 0.5 * s for x, c, s in zip(place, self.center_m, self.size_m, strict=True)]
        inside = max(beyond)
        return -inside if inside < 0.0 else math.hypot(*(max(b, 0.0) for b in beyond))

    @model_validator(mode="after")
    def _check(self) -> "BoxSheet":
        if min(self.size_m) <= 0.0:
            msg = f"size_m = {list(self.size_m)}: allowed: three positive lengths"
            raise ValueError(msg)
        if self.thickness_m > 0.05 * min(self.size_m):
            msg = f"thickness_m = {self.thickness_m:g} is no thin sheet; allowed: up to 1/20 of the smallest side"
            raise ValueError(msg)
        if self.element_m < 0.02 * max(self.size_m):
            msg = f"element_m = {self.element_m:g} makes too many triangles; allowed: from 1/50 of the longest side"
            raise ValueError(msg)
        return self


class Cylinder(SteelPart):
    """Solid cylinder."""

    kind: Literal["cylinder"]
    axis: Vector = Field(description="unit vector along the cylinder")
    radius_m: Positive
    length_m: Positive
    rings: Count = Field(description="finite elements along the radius")
    layers: Count = Field(description="finite elements along the axis")

    _axis = field_validator("axis")(_unit)

    @property
    def element_size_m(self) -> float:
        """Longest edge of the mesh along radius and axis [m]."""
        return max(self.radius_m / self.rings, self.length_m / self.layers)

    def clearance_m(self, place: Vector) -> float:
        """Distance from a place to the surface [m], negative inside."""
        arm = [x - c for x, c in zip(place, self.center_m, strict=True)]
        along = sum(a * e for a, e in zip(arm, self.axis, strict=True))
        across = math.sqrt(max(0.0, sum(a * a for a in arm) - along * along))
        beyond = (abs(along) - 0.5 * self.length_m, across - self.radius_m)
        return max(beyond) if max(beyond) < 0.0 else math.hypot(*(max(b, 0.0) for b in beyond))


Steel = Annotated[BoxSheet | Cylinder, Discriminator("kind")]


class Coil(Strict):
    """A closed loop that stands for the skin around it.

    Its resistance follows from ``conductivity_spm`` and ``section_m2``, or from a wanted ``time_constant_s``.
    """

    name: Name
    vertices_m: Vertices
    wire_radius_m: Positive = Field(description="of the round conductor that carries the skin's current")
    time_constant_s: Positive | None = None
    conductivity_spm: Positive | None = None
    section_m2: Positive | None = None
    mirror: bool = Field(default=False, description="a second loop, mirrored to the other side, named *_mirror")
    source: Source

    @model_validator(mode="after")
    def _one_resistance(self) -> "Coil":
        wire = (self.conductivity_spm, self.section_m2)
        given = [value is not None for value in (self.time_constant_s, *wire)]
        if given not in ([True, False, False], [False, True, True]):
            msg = "its resistance is not clear; allowed: time_constant_s, or both conductivity_spm and section_m2"
            raise ValueError(msg)
        return self


def _unique(what: str, names: Iterable[str]) -> None:
    names = list(names)
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        msg = f"names of {what} must differ, used twice: {', '.join(double)}"
        raise ValueError(msg)


class Magnetics(Strict):
    """Everything magnetic of an aircraft, and where sensors can be mounted."""

    datum: str = Field(min_length=4, description="the structural point that is the origin of body axes")
    mounts: dict[Name, Mount] = Field(min_length=1)
    permanent: Annotated[tuple[Dipole, ...], Field(strict=False)] = ()
    hinged: Annotated[tuple[HingedDipole, ...], Field(strict=False)] = ()
    steel: Annotated[tuple[Steel, ...], Field(strict=False)] = ()
    coils: Annotated[tuple[Coil, ...], Field(strict=False)] = ()

    @model_validator(mode="after")
    def _check_names(self) -> "Magnetics":
        _unique("dipoles", (dipole.name for dipole in (*self.permanent, *self.hinged)))
        _unique("steel parts", (part.name for part in self.steel))
        _unique("coils", (coil.name for coil in self.coils))
        return self

    @model_validator(mode="after")
    def _check_clearance(self) -> "Magnetics":
        """A mesh and a point dipole mean nothing closer than their own size."""
        for name, mount in self.mounts.items():
            place = mount.position_m
            for part in self.steel:
                if part.clearance_m(place) < part.element_size_m:
                    msg = (
                        f"mount {name!r} is {part.clearance_m(place):.3g} m from steel part {part.name!r}; "
                        f"allowed: at least its element size, {part.element_size_m:g} m"
                    )
                    raise ValueError(msg)
            for dipole in (*self.permanent, *self.hinged):
                if math.dist(place, dipole.position_m) < DIPOLE_CLEARANCE_M:
                    msg = (
                        f"mount {name!r} is {math.dist(place, dipole.position_m):.3g} m from dipole {dipole.name!r}; "
                        f"allowed: at least {DIPOLE_CLEARANCE_M:g} m"
                    )
                    raise ValueError(msg)
        return self
