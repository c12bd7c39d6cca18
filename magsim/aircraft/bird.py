"""Facts of a towed bird: the models of ``body.toml``, every number with its unit and its source."""

from typing import Annotated

from pydantic import AfterValidator, Field

from magsim.aircraft.fact import (
    Area,
    Degrees,
    Fact,
    Length,
    Mass,
    Number,
    Position,
    Size,
    SpeedRange,
    VectorFact,
    in_unit,
)
from magsim.config import Strict

Inertias = Annotated[VectorFact, AfterValidator(in_unit("kg m^2"))]
Volume = Annotated[Fact, AfterValidator(in_unit("m^3", positive=True))]
Slope = Annotated[Fact, AfterValidator(in_unit("1/rad"))]
LinearDensity = Annotated[Fact, AfterValidator(in_unit("kg/m", positive=True))]


class RopeFacts(Strict):
    """The rope that belongs to a bird."""

    length: Size
    diameter: Size
    mass_per_length: LinearDensity
    normal_drag: Number
    tangential_drag: Number


class BodyFacts(Strict):
    """The bird as a rigid body in the air; its axes are principal ones."""

    length: Size
    diameter: Size
    mass: Mass
    inertia: Inertias
    center_of_gravity: Position
    bridle: Position
    drag_area: Area
    cross_area: Area
    volume: Volume
    munk_factor: Number


class FinFacts(Strict):
    """Fins in both planes."""

    area: Area
    station: Length
    lift_slope: Slope
    radius: Size


class BirdLimits(Strict):
    """Where the model of the bird is one."""

    true_airspeed: SpeedRange
    flow_angle: Degrees

    @property
    def speed_mps(self) -> tuple[float, float]:
        """Lowest and highest speed of a tow [m/s]."""
        return self.true_airspeed.value


class BirdFacts(Strict):
    """A towed bird as the model of its swing needs it."""

    title: str
    datum: str = Field(min_length=4, description="the structural point that is the origin of its axes")
    body: BodyFacts
    fins: FinFacts
    rope: RopeFacts
    limits: BirdLimits

    @property
    def cg_t(self) -> tuple[float, float, float]:
        """Center of gravity, in its axes from the datum, (3,) [m]."""
        return self.body.center_of_gravity.value
