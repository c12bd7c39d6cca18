"""Control surfaces and autopilot: models of the tables ``[controls]`` and ``[autopilot]`` of ``facts.toml``."""

from typing import Annotated

from pydantic import AfterValidator

from magsim.aircraft.fact import Angle, AngleRange, CurveFact, Duration, Fact, Number, PerSecond, Rate, Speed, in_unit
from magsim.config import Strict


class ControlSurface(Strict):
    """Travel of one control surface."""

    travel: AngleRange


class Flap(Strict):
    """Wing flaps: travel, size, the motor's rate, and the textbook constants of what they do."""

    travel: AngleRange
    rate: Rate
    area_fraction: Number
    chord_fraction: Number
    chord_extension: Number
    section_lift: Number
    section_drag: Number
    pitch_per_lift: Number
    effect: CurveFact
    speed_limit: CurveFact


class Controls(Strict):
    """Control surfaces and their actuators."""

    elevator: ControlSurface
    aileron: ControlSurface
    rudder: ControlSurface
    flap: Flap | None = None
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
    speed: Annotated[Fact, AfterValidator(in_unit("s/m", positive=True))]
    speed_integral: Annotated[Fact, AfterValidator(in_unit("1/m", positive=True))]
    course: PerSecond
    line: Duration
    intercept_limit: Angle
    bank_lag: Duration
    bank_ease: Duration
    bank_limit: Angle
