"""The tow: a bird on a rope under the carrier."""

import math
from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator

from magsim.config import Strict, Vector
from magsim.scenario.base import NonNegative, Positive, aircraft_of, bird_of

LEAST_LINK_M = 0.25
"""Shortest link of a rope: below it the steps of the chain become too many."""


class TowRope(Strict):
    """The rope; a key that is left out takes the value of the bird's file."""

    length_m: Positive | None = Field(default=None, ge=1.0, le=500.0, description="from the hook to the bridle")
    diameter_m: Positive | None = Field(default=None, le=0.1)
    mass_kgpm: Positive | None = Field(default=None, le=5.0, description="for each meter")
    links: int = Field(default=10, ge=2, le=60, description="of the chain that stands for the rope")


class TowBody(Strict):
    """The body at its end; a key that is left out takes the value of the bird's file."""

    mass_kg: Positive | None = Field(default=None, le=2000.0, description="scales the moments of inertia too")
    drag_area_m2: NonNegative | None = Field(default=None, le=10.0, description="along the axis")
    cross_area_m2: NonNegative | None = Field(default=None, le=20.0, description="across the axis")
    fin_area_m2: NonNegative | None = Field(default=None, le=10.0, description="in each plane")
    fin_station_m: float | None = Field(default=None, ge=-20.0, le=20.0, description="from the datum, forward")
    bridle_m: Vector | None = Field(default=None, description="where the rope is tied, from the datum")


class Gusts(Strict):
    """Gusts at the bird besides the air around the carrier: noise of first order on each axis."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"length_m": ("speed_mps",)}

    speed_mps: NonNegative = Field(default=0.3, le=10.0, description="standard deviation on each axis")
    length_m: Positive = Field(default=150.0, le=5000.0, description="length scale; over the airspeed, a time")


class Tow(Strict):
    """A bird on a rope: which one, how long, how flown."""

    bird: str = Field(default="bird", description="name of a shipped bird, or path of a folder of your own: ./mine")
    rope: TowRope = TowRope()
    body: TowBody = TowBody()
    hook_m: Vector | None = Field(
        default=None, description="where the rope is tied, carrier axes from its datum; else that of its file"
    )
    gusts: Gusts = Gusts()
    settle_s: float = Field(
        default=120.0, ge=0.0, le=900.0, description="flown before the first row and not recorded, besides warmup_s"
    )
    coupling: Literal["one_way", "two_way"] = Field(
        default="one_way", description="two_way: the rope pulls on the carrier, by JSBSim's external forces"
    )
    step_hz: int | None = Field(
        default=None, ge=30, le=1920, multiple_of=30, description="steps a second; else as many as the tension needs"
    )

    @field_validator("rope")
    @classmethod
    def _long_enough(cls, rope: TowRope, info: ValidationInfo) -> TowRope:
        bird = bird_of(info)
        length = rope.length_m or (bird.facts.rope.length.value if bird else None)
        if length is not None and length < LEAST_LINK_M * rope.links:
            msg = (
                f"{rope.links} links in {length:g} m of rope are {length / rope.links:.3g} m each; allowed: at least "
                f"{LEAST_LINK_M:g} m, that is up to {max(2, math.floor(length / LEAST_LINK_M))} links, or a longer rope"
            )
            raise ValueError(msg)
        return rope

    @field_validator("hook_m")
    @classmethod
    def _hook_is_known(cls, value: Vector | None, info: ValidationInfo) -> Vector | None:
        aircraft = aircraft_of(info)
        if value is None and aircraft and aircraft.facts.hook_b is None:
            msg = f"the file of {aircraft.name} names no hook; allowed: hook_m = [x, y, z], a place in its axes in m"
            raise ValueError(msg)
        return value
