"""Soft-magnetic parts."""

import math
from typing import Annotated, Literal

from pydantic import Discriminator, Field, field_validator, model_validator

from magsim.aircraft.magnetics.base import Positive, Source, unit
from magsim.config import Name, Strict, Vector

Permeability = Annotated[float, Field(gt=1.0, le=1e6, description="relative permeability")]
Count = Annotated[int, Field(ge=1, le=64)]


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

    _axis = field_validator("axis")(unit)

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
