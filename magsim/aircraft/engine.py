"""Engine and propeller: models of the table ``[engine]`` of ``facts.toml``."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from magsim.aircraft.fact import (
    Angle,
    AngleRange,
    CurveFact,
    Duration,
    Fact,
    Force,
    Inertia,
    Number,
    NumberRange,
    Polynomial,
    Position,
    Power,
    Rate,
    Size,
    in_unit,
)
from magsim.config import Strict


class FixedPropeller(Strict):
    """A propeller of fixed pitch, for the speed at which it turns: its thrust coefficient over the advance ratio."""

    diameter: Size
    thrust_coefficient: Polynomial
    """Factors of 1, J and J^2."""

    @model_validator(mode="after")
    def _falls(self) -> "FixedPropeller":
        at_rest, _, last = self.thrust_coefficient.value
        if not (at_rest > 0.0 and last <= 0.0):
            msg = (
                f"thrust_coefficient = {list(self.thrust_coefficient.value)} has not one speed for each thrust; "
                "allowed: a first factor above 0 and a last one not above 0"
            )
            raise ValueError(msg)
        return self


class DirectEngine(Strict):
    """Thrust as a function of speed, height and lever; ``propeller`` gives its speed of rotation."""

    kind: Literal["direct"]
    power: Power
    propeller_efficiency: Number
    static_thrust: Force
    height_factor: CurveFact
    position: Position
    propeller: FixedPropeller | None = None


class Propeller(Strict):
    """Blades, governor and inertia of a propeller; its coefficients follow by blade element theory."""

    diameter: Size
    blades: Number
    speed: Rate
    hub_radius_fraction: Number
    chord: CurveFact
    twist_advance_ratio: Number
    lift_slope: Number
    lift_limit: NumberRange
    zero_lift_angle: Angle
    profile_drag: Number
    drag_rise: Number
    drag_lift: Number
    pitch_range: AngleRange
    inertia: Inertia


class TurbopropEngine(Strict):
    """A free turbine, flat rated, with a propeller that a governor holds at its speed."""

    kind: Literal["turboprop"]
    power: Power
    torque: Annotated[Fact, AfterValidator(in_unit("N m", positive=True))]
    thermodynamic_power: Power
    density_exponent: Number
    fuel_flow: Annotated[Fact, AfterValidator(in_unit("kg/s", positive=True))]
    idle_fuel_fraction: Number
    gas_generator: NumberRange
    spool_time: Duration
    position: Position
    propeller: Propeller


Engine = Annotated[DirectEngine | TurbopropEngine, Field(discriminator="kind")]
