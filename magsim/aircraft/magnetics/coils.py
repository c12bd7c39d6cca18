"""Loops that stand for the skin."""

from pydantic import Field, model_validator

from magsim.aircraft.magnetics.base import Positive, Source, Vertices
from magsim.config import Name, Strict


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
