"""Soft-magnetic parts: thin sheets and solids that the ambient field and the permanent moments magnetize."""

import itertools
import math
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BeforeValidator, Discriminator, Field, field_validator, model_validator

from magsim.aircraft.magnetics.base import Hangs, Positive, Source, unit
from magsim.config import Name, Strict, Vector

Permeability = Annotated[float, Field(ge=1.0, le=1e6, description="relative permeability")]
Count = Annotated[int, Field(ge=1, le=64)]
Element = Annotated[float, Field(gt=0.0, description="largest edge of the mesh along the part")]


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


Pair = Annotated[tuple[Positive, Positive], BeforeValidator(_as_tuple)]
Line = Annotated[tuple[Vector, ...], BeforeValidator(_as_tuple), Field(min_length=2, max_length=64)]

SHARPEST_BEND = math.radians(120.0)
"""Largest change of direction at a corner of a line that a part follows."""


def _subtract(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _across(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _to_block(arm: Vector, axes: Sequence[Vector], size: Sequence[float]) -> float:
    """Return the distance from a block around the origin, negative inside."""
    beyond = [abs(_dot(arm, axis)) - 0.5 * length for axis, length in zip(axes, size, strict=True)]
    return max(beyond) if max(beyond) < 0.0 else math.hypot(*(max(b, 0.0) for b in beyond))


def _to_line(place: Vector, points: Sequence[Vector]) -> float:
    """Return the distance from a line of straight pieces."""
    out = math.inf
    for start, stop in itertools.pairwise(points):
        way, arm = _subtract(stop, start), _subtract(place, start)
        share = min(1.0, max(0.0, _dot(arm, way) / _dot(way, way)))
        out = min(out, math.hypot(*(a - share * w for a, w in zip(arm, way, strict=True))))
    return out


def _check_square(first: Vector, second: Vector, names: str) -> None:
    if abs(_dot(first, second)) > 1e-6:
        msg = f"{names} are not perpendicular, their product is {_dot(first, second):.3g}; allowed: a right angle"
        raise ValueError(msg)


def _check_line(points: Sequence[Vector], name: str) -> None:
    ways = [_subtract(b, a) for a, b in itertools.pairwise(points)]
    for number, way in enumerate(ways):
        if math.hypot(*way) == 0.0:
            msg = f"{name}[{number}] and {name}[{number + 1}] are the same place; allowed: places that differ"
            raise ValueError(msg)
    for number, (a, b) in enumerate(itertools.pairwise(ways)):
        if _dot(a, b) < math.cos(SHARPEST_BEND) * math.hypot(*a) * math.hypot(*b):
            msg = (
                f"the line turns back at {name}[{number + 1}]; allowed: bends up to {math.degrees(SHARPEST_BEND):g} deg"
            )
            raise ValueError(msg)


def _check_facing(facing: Vector, points: Sequence[Vector], key: str) -> None:
    way = _subtract(points[1], points[0])
    if math.hypot(*_across(facing, way)) < 0.1 * math.hypot(*way):
        msg = f"{key} = {list(facing)} runs along the part; allowed: a direction across it"
        raise ValueError(msg)


def _check_thin(thickness: float, size: float, share: int, what: str) -> None:
    if thickness > size / share:
        msg = f"thickness_m = {thickness:g} is no thin sheet; allowed: up to 1/{share} of {what}, {size / share:g}"
        raise ValueError(msg)


class SteelPart(Strict):
    """What every soft-magnetic part has."""

    name: Name
    mu_r: Permeability
    mirror: bool = Field(default=False, description="a second part, mirrored to the other side, named *_mirror")
    suspension: Hangs = None
    source: Source

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the part, and of its mirror image where it has one."""
        return (self.name, f"{self.name}_mirror") if self.mirror else (self.name,)

    @property
    def element_size_m(self) -> float:
        """Longest edge of the mesh along the part [m]; 0 where only its mesh knows."""
        return 0.0

    def clearance_m(self, place: Vector) -> float:
        """Return the distance to the nearest metal [m], negative inside; infinite where only a mesh knows."""
        x, y, z = place
        return min(self._distance_m(place), self._distance_m((x, -y, z))) if self.mirror else self._distance_m(place)

    def _distance_m(self, place: Vector) -> float:
        del place
        return math.inf


class Meshed(SteelPart):
    """A part whose mesh is ruled by the size of its elements."""

    element_m: Element

    @property
    def element_size_m(self) -> float:
        """Longest edge of the mesh along the part [m]."""
        return self.element_m


class BoxSheet(Meshed):
    """Closed box of thin steel sheet, along the body axes: a tank."""

    kind: Literal["box_sheet"]
    center_m: Vector
    size_m: Vector
    thickness_m: Positive

    def _distance_m(self, place: Vector) -> float:
        axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        return abs(_to_block(_subtract(place, self.center_m), axes, self.size_m))

    @model_validator(mode="after")
    def _check(self) -> "BoxSheet":
        if min(self.size_m) <= 0.0:
            msg = f"size_m = {list(self.size_m)}: allowed: three positive lengths"
            raise ValueError(msg)
        _check_thin(self.thickness_m, min(self.size_m), 20, "the smallest side")
        if self.element_m < 0.02 * max(self.size_m):
            msg = f"element_m = {self.element_m:g} makes too many triangles; allowed: from 1/50 of the longest side"
            raise ValueError(msg)
        return self


class Plate(Meshed):
    """Flat rectangle of thin sheet, in any direction: a firewall."""

    kind: Literal["plate"]
    center_m: Vector
    normal: Vector = Field(description="unit vector across the plate")
    along: Vector = Field(description="unit vector along its first side")
    size_m: Pair = Field(description="first side and the other")
    thickness_m: Positive

    _units = field_validator("normal", "along")(unit)

    def _distance_m(self, place: Vector) -> float:
        axes = (self.along, _across(self.normal, self.along), self.normal)
        return max(0.0, _to_block(_subtract(place, self.center_m), axes, (*self.size_m, 0.0)))

    @model_validator(mode="after")
    def _check(self) -> "Plate":
        _check_square(self.normal, self.along, "normal and along")
        _check_thin(self.thickness_m, min(self.size_m), 10, "the smaller side")
        return self


class Strip(Meshed):
    """Flat strip of thin sheet along a line: a seat rail."""

    kind: Literal["strip"]
    points_m: Line
    facing: Vector = Field(description="unit vector across the face of the strip at its first point")
    width_m: Positive
    thickness_m: Positive

    _unit = field_validator("facing")(unit)

    def _distance_m(self, place: Vector) -> float:
        return max(0.0, _to_line(place, self.points_m) - 0.5 * self.width_m)

    @model_validator(mode="after")
    def _check(self) -> "Strip":
        _check_line(self.points_m, "points_m")
        _check_facing(self.facing, self.points_m, "facing")
        _check_thin(self.thickness_m, self.width_m, 10, "width_m")
        return self


class Tube(Meshed):
    """Round tube of thin wall along a line: an engine mount, a control rod."""

    kind: Literal["tube"]
    points_m: Line
    radius_m: Positive = Field(description="of the middle of the wall")
    thickness_m: Positive
    sides: Annotated[int, Field(ge=6, le=64)] = Field(default=8, description="flat sides around the tube")
    closed: bool = Field(default=False, description="with a disc of the same sheet at both ends")

    def _distance_m(self, place: Vector) -> float:
        return max(0.0, _to_line(place, self.points_m) - self.radius_m)

    @model_validator(mode="after")
    def _check(self) -> "Tube":
        _check_line(self.points_m, "points_m")
        _check_thin(self.thickness_m, self.radius_m, 5, "radius_m")
        return self


class Cylinder(SteelPart):
    """Solid cylinder."""

    kind: Literal["cylinder"]
    center_m: Vector
    axis: Vector = Field(description="unit vector along the cylinder")
    radius_m: Positive
    length_m: Positive
    rings: Count = Field(description="finite elements along the radius")
    layers: Count = Field(description="finite elements along the axis")

    _axis = field_validator("axis")(unit)

    @property
    def element_size_m(self) -> float:
        """Longest edge of the mesh along radius and axis [m]."""
        return max(self.radius_m / self.rings, self.length_m / self.layers)

    def _distance_m(self, place: Vector) -> float:
        arm = _subtract(place, self.center_m)
        along = _dot(arm, self.axis)
        across = math.sqrt(max(0.0, _dot(arm, arm) - along * along))
        beyond = (abs(along) - 0.5 * self.length_m, across - self.radius_m)
        return max(beyond) if max(beyond) < 0.0 else math.hypot(*(max(b, 0.0) for b in beyond))


class Bar(Meshed):
    """Solid rectangular block, in any direction."""

    kind: Literal["bar"]
    center_m: Vector
    along: Vector = Field(default=(1.0, 0.0, 0.0), description="unit vector along its first side")
    across: Vector = Field(default=(0.0, 1.0, 0.0), description="unit vector along its second side")
    size_m: Vector = Field(description="first, second and third side")

    _units = field_validator("along", "across")(unit)

    def _distance_m(self, place: Vector) -> float:
        axes = (self.along, self.across, _across(self.along, self.across))
        return _to_block(_subtract(place, self.center_m), axes, self.size_m)

    @model_validator(mode="after")
    def _check(self) -> "Bar":
        if min(self.size_m) <= 0.0:
            msg = f"size_m = {list(self.size_m)}: allowed: three positive lengths"
            raise ValueError(msg)
        _check_square(self.along, self.across, "along and across")
        return self


class Section(Strict):
    """Section of a loft, across its line."""

    center_m: Vector
    size_m: Pair = Field(description="extent along 'across', and perpendicular to it")


class Loft(Meshed):
    """Solid through sections, straight or bent, tapered or not: a leg of the gear."""

    kind: Literal["loft"]
    shape: Literal["rectangle", "ellipse"]
    across: Vector = Field(description="unit vector along the first extent of the sections")
    sections: Annotated[tuple[Section, ...], Field(strict=False, min_length=2, max_length=64)]

    _unit = field_validator("across")(unit)

    @model_validator(mode="after")
    def _check(self) -> "Loft":
        centers = [section.center_m for section in self.sections]
        _check_line(centers, "sections")
        for pair in itertools.pairwise(centers):
            _check_facing(self.across, pair, "across")
        return self


class MeshPart(SteelPart):
    """A part from a file of triangles beside ``magnetics.toml``: a thin sheet, or the closed surface of a solid."""

    kind: Literal["mesh"]
    file: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}\.(stl|ply|obj)$")] = Field(
        description="name of an STL, PLY or OBJ file in the folder of the aircraft"
    )
    body: Literal["sheet", "solid"]
    thickness_m: Positive | None = Field(default=None, description="of a sheet")
    unit_m: Annotated[float, Field(gt=0.0, le=1000.0)] = Field(
        description="length of one unit of the file: 0.001 for mm"
    )
    axes: Literal["body", "structural"] = Field(
        description="axes of the file: body is forward, right, down; structural is aft, right, up"
    )
    position_m: Vector = Field(default=(0.0, 0.0, 0.0), description="place of the file's origin in body axes")

    @model_validator(mode="after")
    def _check(self) -> "MeshPart":
        if (self.body == "sheet") != (self.thickness_m is not None):
            msg = f"body = {self.body!r}: allowed: thickness_m with a sheet, and without it a solid"
            raise ValueError(msg)
        return self


Steel = Annotated[
    BoxSheet | Plate | Strip | Tube | Cylinder | Bar | Loft | MeshPart,
    Discriminator("kind"),
]
