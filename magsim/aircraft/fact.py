"""A number with its unit and its source: the elements of all facts.

A fact is an inline table ``{ value = 15.87, unit = "m", source = "..." }``. A source that begins with ``estimate``
marks a number of our own. Values are SI with angles in radians, but for limits that face the user, which are in
degrees.
"""

from collections.abc import Callable
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from magsim.config import Strict, Vector


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


class Fact(Strict):
    """One number with its unit and its source."""

    value: float
    unit: str
    source: str = Field(min_length=3)

    @property
    def estimated(self) -> bool:
        """Whether the number is an estimate of ours."""
        return self.source.startswith("estimate")


class VectorFact(Strict):
    """A place in body axes from the datum [m]."""

    value: Vector
    unit: str
    source: str = Field(min_length=3)


class RangeFact(Strict):
    """A lowest and a highest value."""

    value: Annotated[tuple[float, float], BeforeValidator(_as_tuple)]
    unit: str
    source: str = Field(min_length=3)

    @model_validator(mode="after")
    def _ordered(self) -> "RangeFact":
        if not self.value[0] < self.value[1]:
            msg = f"{self.value[0]:g} is not below {self.value[1]:g}; allowed: [low, high]"
            raise ValueError(msg)
        return self


class CurveFact(Strict):
    """A quantity over another one, given at points that rise."""

    at: Annotated[tuple[float, ...], BeforeValidator(_as_tuple), Field(min_length=2)]
    at_unit: str
    value: Annotated[tuple[float, ...], BeforeValidator(_as_tuple), Field(min_length=2)]
    unit: str
    source: str = Field(min_length=3)

    @model_validator(mode="after")
    def _table(self) -> "CurveFact":
        if len(self.at) != len(self.value):
            msg = f"{len(self.at)} points but {len(self.value)} values; allowed: as many of both"
            raise ValueError(msg)
        if any(b <= a for a, b in zip(self.at, self.at[1:], strict=False)):
            msg = "the points of 'at' do not rise; allowed: rising points"
            raise ValueError(msg)
        return self


AnyFact = Fact | VectorFact | RangeFact


def in_unit(unit: str, *, positive: bool = False) -> Callable[[AnyFact], AnyFact]:
    """Return a validator that refuses facts in another unit."""

    def check(fact: AnyFact) -> AnyFact:
        if fact.unit != unit:
            msg = f"unit {fact.unit!r}; allowed: {unit!r}"
            raise ValueError(msg)
        if positive and isinstance(fact, Fact) and not fact.value > 0.0:
            msg = f"{fact.value:g} {unit}; allowed: above 0"
            raise ValueError(msg)
        return fact

    return check


Length = Annotated[Fact, AfterValidator(in_unit("m"))]
Size = Annotated[Fact, AfterValidator(in_unit("m", positive=True))]
Area = Annotated[Fact, AfterValidator(in_unit("m^2", positive=True))]
Mass = Annotated[Fact, AfterValidator(in_unit("kg", positive=True))]
Power = Annotated[Fact, AfterValidator(in_unit("W", positive=True))]
Force = Annotated[Fact, AfterValidator(in_unit("N", positive=True))]
Speed = Annotated[Fact, AfterValidator(in_unit("m/s", positive=True))]
Duration = Annotated[Fact, AfterValidator(in_unit("s", positive=True))]
Angle = Annotated[Fact, AfterValidator(in_unit("rad"))]
Degrees = Annotated[Fact, AfterValidator(in_unit("deg", positive=True))]
Rate = Annotated[Fact, AfterValidator(in_unit("rad/s", positive=True))]
PerSecond = Annotated[Fact, AfterValidator(in_unit("1/s", positive=True))]
Number = Annotated[Fact, AfterValidator(in_unit("1"))]
Inertia = Annotated[Fact, AfterValidator(in_unit("kg m^2", positive=True))]
Polynomial = Annotated[VectorFact, AfterValidator(in_unit("1"))]
Position = Annotated[VectorFact, AfterValidator(in_unit("m"))]
AngleRange = Annotated[RangeFact, AfterValidator(in_unit("rad"))]
DegreeRange = Annotated[RangeFact, AfterValidator(in_unit("deg"))]
SpeedRange = Annotated[RangeFact, AfterValidator(in_unit("m/s"))]
NumberRange = Annotated[RangeFact, AfterValidator(in_unit("1"))]


class Envelope(Strict):
    """Limits of height, speed and bank of any carrier."""

    ceiling: Size
    true_airspeed: SpeedRange
    turn_bank: Degrees

    @property
    def alt_m(self) -> float:
        """Ceiling [m] above the ellipsoid."""
        return self.ceiling.value

    @property
    def speed_mps(self) -> tuple[float, float]:
        """Lowest and highest true airspeed that can be held [m/s]."""
        return self.true_airspeed.value
