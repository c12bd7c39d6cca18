"""The air: steady wind, shear, gusts, turbulence.

Wind is the motion of the air over ground, to north, east and down. ``wind_*_mps`` is the wind at the height of the
start; shear makes it differ at other heights.
"""

import math
from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator

from magsim.config import Strict
from magsim.scenario.base import NonNegative, Positive
from magsim.scenario.start import Start

Wind = Annotated[float, Field(ge=-100.0, le=100.0)]


class LinearShear(Strict):
    """Wind that changes evenly with height."""

    kind: Literal["linear"] = "linear"
    north_per_s: float = Field(default=0.0, ge=-0.5, le=0.5, description="m/s more to north for each meter up")
    east_per_s: float = Field(default=0.0, ge=-0.5, le=0.5, description="m/s more to east for each meter up")


class LogShear(Strict):
    """Wind that grows with the logarithm of the height above ground, up to a top; above it stays.

    MIL-F-8785C, 3.7.3.2, has 305 m (1000 ft) for the top and roughness lengths of 0.046 m (0.15 ft, takeoff and
    landing) and 0.61 m (2 ft).
    """

    kind: Literal["log"] = "log"
    roughness_m: float = Field(default=0.0457, gt=0.0, le=5.0, description="height at which the profile reaches zero")
    top_m: float = Field(default=304.8, ge=10.0, le=5000.0, description="height above ground where growth ends")


class Gust(Strict):
    """One gust of the form ``(1 - cos) / 2``: it rises from nothing to its full wind and falls again."""

    at_s: float = Field(ge=1.0, description="time at which it begins, counted from the first row")
    duration_s: float = Field(gt=0.0, le=600.0, description="from its beginning to its end; full in the middle")
    north_mps: Wind = 0.0
    east_mps: Wind = 0.0
    down_mps: Wind = 0.0


class RandomGusts(Strict):
    """Gusts at random times in random directions, drawn from the scenario's seed."""

    every_s: float = Field(ge=1.0, description="mean time from one to the next, exponentially distributed")
    speed_mps: Positive = Field(le=50.0, description="the strongest; sizes are even between none and it")
    shortest_s: float = Field(default=1.0, gt=0.0, le=600.0)
    longest_s: float = Field(default=8.0, gt=0.0, le=600.0, description="durations are even between the two")

    @field_validator("longest_s")
    @classmethod
    def _ordered(cls, value: float, info: ValidationInfo) -> float:
        shortest = info.data.get("shortest_s")
        if shortest is not None and value < shortest:
            msg = f"{value:g} s is shorter than shortest_s; allowed: {shortest:g} or more"
            raise ValueError(msg)
        return value


Shear = Annotated[LinearShear | LogShear, Discriminator("kind")]


class Air(Strict):
    """Wind, shear, gusts and turbulence."""

    wind_north_mps: Wind = Field(default=0.0, description="where the air moves to: north, at the start's height")
    wind_east_mps: Wind = Field(default=0.0, description="where the air moves to: east, at the start's height")
    shear: Shear | None = Field(default=None, description="how the wind changes with height")
    gusts: tuple[Gust, ...] = Field(default=(), strict=False, description="single gusts, which may overlap")
    random_gusts: RandomGusts | None = None
    turbulence_severity: int = Field(
        default=0,
        ge=0,
        le=7,
        description="strength by MIL-F-8785C: 3 light, 4 moderate, 6 severe, by height above ground; 0 none",
    )
    turbulence_mps: NonNegative = Field(
        default=0.0,
        le=15.0,
        description="strength without a severity: standard deviation of the vertical gusts, at every height; 0 none",
    )

    @field_validator("turbulence_mps")
    @classmethod
    def _one_strength(cls, value: float, info: ValidationInfo) -> float:
        severity = info.data.get("turbulence_severity")
        if value and severity:
            msg = f"{value:g} m/s and turbulence_severity = {severity} are two strengths; allowed: one, the other 0"
            raise ValueError(msg)
        return value

    @property
    def wind_mps(self) -> tuple[float, float]:
        """Wind at the start's height, to north and east [m/s]."""
        return self.wind_north_mps, self.wind_east_mps

    def strongest_gust_mps(self) -> float:
        """Return the most that gusts can add to the horizontal wind [m/s]."""
        ends = [(gust, gust.at_s, gust.at_s + gust.duration_s) for gust in self.gusts]
        together = [
            math.fsum(math.hypot(g.north_mps, g.east_mps) for g, start, stop in ends if start <= moment < stop)
            for _, moment, _ in ends
        ]
        drawn = self.random_gusts.speed_mps if self.random_gusts else 0.0
        return max(together, default=0.0) + drawn


def log_factor(height_m: float, shear: LogShear) -> float:
    """Return the wind of the logarithmic profile at a height above ground, to some scale."""
    height = min(max(height_m, 2.0 * shear.roughness_m), shear.top_m)
    return math.log(height / shear.roughness_m)


def wind_at(air: Air, start: Start, alt_m: float, ground_m: float = 0.0) -> tuple[float, float]:
    """Return the steady wind to north and east [m/s] at a height above the ellipsoid, over ground of a given height."""
    north, east = air.wind_mps
    if isinstance(air.shear, LinearShear):
        above = alt_m - start.alt_m
        return north + air.shear.north_per_s * above, east + air.shear.east_per_s * above
    if isinstance(air.shear, LogShear):
        factor = log_factor(alt_m - ground_m, air.shear) / log_factor(start.alt_m - ground_m, air.shear)
        return north * factor, east * factor
    return north, east
