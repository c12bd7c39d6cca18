"""What the steel of an aircraft remembers: hysteresis and viscosity."""

from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from magsim.aircraft.magnetics.base import Positive, Source, as_tuple
from magsim.config import Strict

Numbers = Annotated[tuple[float, ...], BeforeValidator(as_tuple)]


class Memory(Strict):
    """Play operators and slow exponentials, as parts of the induced magnetization.

    Each operator gives back ``weights`` of the field once it is dragged along; ``radii_nt`` is half the width of its
    loop. Each exponential gives ``viscosity_weights`` of the field after ``viscosity_s``.
    """

    radii_nt: Numbers = ()
    weights: Numbers = ()
    viscosity_s: Annotated[tuple[Positive, ...], BeforeValidator(as_tuple)] = ()
    viscosity_weights: Numbers = ()
    source: Source = Field()

    @model_validator(mode="after")
    def _pairs(self) -> "Memory":
        for values, of in (("weights", "radii_nt"), ("viscosity_weights", "viscosity_s")):
            if len(getattr(self, values)) != len(getattr(self, of)):
                msg = (
                    f"{len(getattr(self, values))} {values} but {len(getattr(self, of))} {of}; allowed: as many of both"
                )
                raise ValueError(msg)
        if any(radius < 0.0 for radius in self.radii_nt):
            msg = f"radii_nt = {list(self.radii_nt)}: allowed: none below 0"
            raise ValueError(msg)
        for name in ("weights", "viscosity_weights"):
            if any(weight < 0.0 for weight in getattr(self, name)):
                msg = f"{name} = {list(getattr(self, name))}: allowed: none below 0; a loop turns no energy into field"
                raise ValueError(msg)
        return self
