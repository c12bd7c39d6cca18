"""The skin of an aircraft as closed shells lofted through sections: conducting, or drawn alone."""

import itertools
from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BeforeValidator, Discriminator, Field, model_validator

from magsim.aircraft.magnetics.base import NonNegative, Positive, Source, as_tuple
from magsim.config import Name, Strict

Resistances = Annotated[tuple[NonNegative, ...], BeforeValidator(as_tuple)]


class BodySection(Strict):
    """Section of a fuselage across the forward axis: a superellipse."""

    x_m: float = Field(description="place along the forward axis")
    y_m: float = Field(default=0.0, description="center, right")
    width_m: Positive
    height_m: Positive
    z_m: float = Field(default=0.0, description="center, down")
    exponent: float = Field(
        default=2.0, ge=2.0, le=10.0, description="2: ellipse; larger: rectangle with round corners"
    )


class PanelSection(Strict):
    """Section of a wing, tailplane or fin: an ellipse of the profile's chord and depth."""

    at_m: float = Field(description="place along the span: y of a wing from 0 to the right tip, z of a fin to its tip")
    leading_edge_m: float = Field(description="x of the leading edge")
    chord_m: Positive
    depth_m: Positive = Field(description="greatest thickness of the profile")
    offset_m: float = Field(default=0.0, description="z of a wing's chord, y of a fin's")


class Shell(Strict):
    """What every shell has."""

    name: Name
    source: Source


class Metal(Strict):
    """What a shell of the skin has beside its shape."""

    conductivity_spm: Positive
    thickness_m: Positive = Field(description="of the metal")
    seams_ohm_m: Resistances = Field(
        default=(),
        description="resistance of the joint of sheets at each section but the ends, times its length; the root of a "
        "wing has one too; left out: no joints",
    )

    @property
    @abstractmethod
    def seam_places_m(self) -> tuple[float, ...]:
        """Places where sheets are joined [m]."""

    @model_validator(mode="after")
    def _a_number_for_each(self) -> "Metal":
        count = len(self.seam_places_m)
        if self.seams_ohm_m and len(self.seams_ohm_m) != count:
            msg = f"{len(self.seams_ohm_m)} seams_ohm_m; allowed: none, or one for each joint, {count}"
            raise ValueError(msg)
        return self


def _ordered(places: Sequence[float], what: str) -> None:
    steps = [b - a for a, b in itertools.pairwise(places)]
    if not (all(step > 0.0 for step in steps) or all(step < 0.0 for step in steps)):
        msg = f"{what} = {list(places)}: allowed: sections in order from one end to the other, no two at one place"
        raise ValueError(msg)


class BodyShell(Shell):
    """A closed body along the forward axis."""

    kind: Literal["body"]
    sections: Annotated[tuple[BodySection, ...], Field(strict=False, min_length=2)]

    @model_validator(mode="after")
    def _check(self) -> "BodyShell":
        _ordered([section.x_m for section in self.sections], "x_m")
        return self


class PanelShell(Shell):
    """A closed wing or fin. A wing runs to the right from the plane of symmetry and is mirrored to the left."""

    kind: Literal["panel"]
    span: Literal["right", "up"]
    sections: Annotated[tuple[PanelSection, ...], Field(strict=False, min_length=2)]

    @model_validator(mode="after")
    def _check(self) -> "PanelShell":
        places = [section.at_m for section in self.sections]
        _ordered(places, "at_m")
        if self.span == "right" and (places[0] != 0.0 or places[-1] < 0.0):
            msg = f"at_m = {places}: a panel with span = 'right' runs from 0 to its right tip"
            raise ValueError(msg)
        return self


class Body(Metal, BodyShell):
    """A body of the skin."""

    @property
    def seam_places_m(self) -> tuple[float, ...]:
        """Places along the forward axis where sheets are joined: all sections but the ends."""
        return tuple(section.x_m for section in self.sections[1:-1])


class Panel(Metal, PanelShell):
    """A wing or fin of the skin."""

    @property
    def seam_places_m(self) -> tuple[float, ...]:
        """Places along the span where sheets are joined: all sections but the ends; a wing does not end at its root."""
        first = 0 if self.span == "right" else 1
        return tuple(section.at_m for section in self.sections[first:-1])


def _check_names(parts: Sequence[Shell], what: str) -> None:
    names = [part.name for part in parts]
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        msg = f"names of {what} parts must differ, used twice: {', '.join(double)}"
        raise ValueError(msg)


class Skin(Strict):
    """The conducting skin: closed shells that do not touch each other."""

    element_m: Annotated[float, Field(ge=0.1, le=2.0)] = Field(description="edge of the mesh along the parts")
    parts: Annotated[tuple[Annotated[Body | Panel, Discriminator("kind")], ...], Field(strict=False, min_length=1)]

    @model_validator(mode="after")
    def _check(self) -> "Skin":
        _check_names(self.parts, "skin")
        return self


class DrawnOutline(Strict):
    """Closed shells of an aircraft without a conducting skin: they are drawn and carry nothing. They may cross."""

    element_m: Annotated[float, Field(ge=0.01, le=2.0)] = Field(description="edge of the mesh along the parts")
    parts: Annotated[
        tuple[Annotated[BodyShell | PanelShell, Discriminator("kind")], ...], Field(strict=False, min_length=1)
    ]

    @model_validator(mode="after")
    def _check(self) -> "DrawnOutline":
        _check_names(self.parts, "outline")
        return self
