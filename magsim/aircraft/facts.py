"""What flies: the models of ``facts.toml``, every number with its unit and its source.

A fact is an inline table ``{ value = 15.87, unit = "m", source = "..." }``. A source that begins with ``estimate``
says that the number is ours. Values are SI with angles in radians, but for limits that face the user, which are in
degrees.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from magsim.config import Strict, Vector


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


class Fact(Strict):
    """One number with its unit and where it comes from."""

    value: float
    unit: str
    source: str = Field(min_length=3)

    @property
    def estimated(self) -> bool:
        """Whether the number is an estimate of ours."""
        return self.source.startswith("estimate")


class PlaceFact(Strict):
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


AnyFact = Fact | PlaceFact | RangeFact


def _in(unit: str, *, positive: bool = False) -> Callable[[AnyFact], AnyFact]:
    """Validator: a fact must be given in this unit."""

    def check(fact: AnyFact) -> AnyFact:
        if fact.unit != unit:
            msg = f"unit {fact.unit!r}; allowed: {unit!r}"
            raise ValueError(msg)
        if positive and isinstance(fact, Fact) and not fact.value > 0.0:
            msg = f"{fact.value:g} {unit}; allowed: above 0"
            raise ValueError(msg)
        return fact

    return check


Length = Annotated[Fact, AfterValidator(_in("m"))]
Size = Annotated[Fact, AfterValidator(_in("m", positive=True))]
Area = Annotated[Fact, AfterValidator(_in("m^2", positive=True))]
Mass = Annotated[Fact, AfterValidator(_in("kg", positive=True))]
Power = Annotated[Fact, AfterValidator(_in("W", positive=True))]
Force = Annotated[Fact, AfterValidator(_in("N", positive=True))]
Speed = Annotated[Fact, AfterValidator(_in("m/s", positive=True))]
Duration = Annotated[Fact, AfterValidator(_in("s", positive=True))]
Angle = Annotated[Fact, AfterValidator(_in("rad"))]
Degrees = Annotated[Fact, AfterValidator(_in("deg", positive=True))]
Rate = Annotated[Fact, AfterValidator(_in("rad/s", positive=True))]
PerSecond = Annotated[Fact, AfterValidator(_in("1/s", positive=True))]
Number = Annotated[Fact, AfterValidator(_in("1"))]
Inertia = Annotated[Fact, AfterValidator(_in("kg m^2", positive=True))]
Place = Annotated[PlaceFact, AfterValidator(_in("m"))]
AngleRange = Annotated[RangeFact, AfterValidator(_in("rad"))]
DegreeRange = Annotated[RangeFact, AfterValidator(_in("deg"))]
SpeedRange = Annotated[RangeFact, AfterValidator(_in("m/s"))]
NumberRange = Annotated[RangeFact, AfterValidator(_in("1"))]


class Datum(Strict):
    """Origin of body coordinates: where it lies in the structural frame (x aft, y right, z up)."""

    description: str
    station: Length
    buttline: Length
    waterline: Length


class Geometry(Strict):
    """Wing, tail and the distances between them."""

    span: Size
    wing_area: Area
    mean_chord: Size
    mean_chord_leading_edge: Length
    length: Size
    tailplane_span: Size
    tailplane_area: Area
    tailplane_arm: Size
    fin_height: Size
    fin_area: Area
    fin_arm: Size
    fin_center_above_cg: Size
    wheels: tuple[Place, ...] = Field(min_length=3, strict=False)


class MassFacts(Strict):
    """Mass, center of gravity, radii of gyration."""

    mass: Mass
    cg_chord_fraction: Number
    cg_below_datum: Length
    gyration_roll: Number
    gyration_pitch: Number
    gyration_yaw: Number
    ixz_over_izz: Number


class Aero(Strict):
    """Constants of the formulas that turn geometry into stability derivatives, and what they do not give."""

    lift_at_zero_alpha: Number
    lift_linear_range: AngleRange
    lift_curve: CurveFact
    oswald_efficiency: Number
    sideslip_drag: Number
    downwash_factor: Number
    tailplane_efficiency: Number
    surface_effectiveness: Number
    wing_center_chord_fraction: Number
    power_shift_chord_fraction: Number
    pitch_damping_factor: Number
    pitch_at_zero_alpha: Number
    fin_aspect_factor: Number
    fin_efficiency: Number
    body_side_force: Number
    body_yaw_stiffness: Number
    dihedral_roll: Number
    high_wing_roll: Number
    roll_damping: Number
    reference_lift: Number
    body_yaw_damping: Number
    aileron_roll: Number
    aileron_yaw: Number
    cruise_speed: Speed
    cruise_altitude: Size
    cruise_density: Annotated[Fact, AfterValidator(_in("kg/m^3", positive=True))]
    cruise_mass: Mass


class DirectEngine(Strict):
    """Thrust as a function of speed, height and lever, without a propeller that turns."""

    kind: Literal["direct"]
    power: Power
    propeller_efficiency: Number
    static_thrust: Force
    height_factor: CurveFact
    position: Place


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
    torque: Annotated[Fact, AfterValidator(_in("N m", positive=True))]
    thermodynamic_power: Power
    density_exponent: Number
    fuel_flow: Annotated[Fact, AfterValidator(_in("kg/s", positive=True))]
    idle_fuel_fraction: Number
    gas_generator: NumberRange
    spool_time: Duration
    position: Place
    propeller: Propeller


Engine = Annotated[DirectEngine | TurbopropEngine, Field(discriminator="kind")]


class Surface(Strict):
    """Travel of one control surface."""

    travel: AngleRange


class Controls(Strict):
    """Control surfaces and their actuators."""

    elevator: Surface
    aileron: Surface
    rudder: Surface
    actuator_lag: Rate
    actuator_rate: Rate


class Autopilot(Strict):
    """Gains of the loops of the survey autopilot."""

    altitude: PerSecond
    climb_limit: Speed
    path: Number
    path_integral: PerSecond
    path_limit: Angle
    pitch: PerSecond
    pitch_rate: Duration
    pitch_integral: PerSecond
    pitch_integral_limit: Number
    roll: PerSecond
    roll_rate: Duration
    roll_integral: PerSecond
    roll_integral_limit: Number
    coordination: Duration
    yaw: PerSecond
    yaw_rate: Duration
    speed: Annotated[Fact, AfterValidator(_in("s/m", positive=True))]
    speed_integral: Annotated[Fact, AfterValidator(_in("1/m", positive=True))]
    course: PerSecond
    line: Duration
    intercept_limit: Angle
    bank_lag: Duration
    bank_ease: Duration
    bank_limit: Angle


class Limits(Strict):
    """What the aircraft can be asked to do, and where the flight model stops being one."""

    ceiling: Size
    true_airspeed: SpeedRange
    turn_bank: Degrees
    pitch_amplitude: Degrees
    roll_amplitude: Degrees
    yaw_amplitude: Degrees
    design_load_factor: NumberRange
    crew_load_factor: NumberRange | None = None
    angle_of_attack: DegreeRange
    sideslip: Degrees
    bank: Degrees
    pitch: Degrees

    @property
    def alt_m(self) -> float:
        """Ceiling [m] above the ellipsoid."""
        return self.ceiling.value

    @property
    def speed_mps(self) -> tuple[float, float]:
        """Lowest and highest true airspeed that can be held [m/s]."""
        return self.true_airspeed.value

    @cached_property
    def amplitude_deg(self) -> dict[str, float]:
        """Largest amplitude of a maneuver (half of peak to peak) [deg] on the axes pitch, roll, yaw."""
        return {axis: getattr(self, f"{axis}_amplitude").value for axis in ("pitch", "roll", "yaw")}

    @property
    def load_factor(self) -> tuple[float, float]:
        """Lowest and highest design load factor [g]."""
        return self.design_load_factor.value

    @property
    def crew(self) -> tuple[float, float] | None:
        """Lowest and highest load factor that a crew flies in a preset [g]; None where nobody is aboard."""
        return None if self.crew_load_factor is None else self.crew_load_factor.value


class Facts(Strict):
    """An aircraft as the flight model needs it."""

    title: str
    datum: Datum
    geometry: Geometry
    mass: MassFacts
    aero: Aero
    engine: Engine
    controls: Controls
    autopilot: Autopilot
    limits: Limits

    @property
    def cg_b(self) -> tuple[float, float, float]:
        """Center of gravity in body axes from the datum, (3,) [m]."""
        geometry = self.geometry
        station = geometry.mean_chord_leading_edge.value
        station += self.mass.cg_chord_fraction.value * geometry.mean_chord.value
        return (self.datum.station.value - station, 0.0, self.mass.cg_below_datum.value)
