"""A scenario: where, when, how flown, which physics, which instruments, which seed.

The models here are the meaning of a scenario file; ``magsim.config`` reads it and reports every error with
file and line. Limits that belong to the aircraft are checked in the same pass: the aircraft comes in as
``context["aircraft"]`` of the validation.
"""

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator

from magsim import assets, config
from magsim.aircraft import Aircraft, load_aircraft
from magsim.config import Name, Numbers, Problems, Strict, Vector
from magsim.errors import RequestError
from magsim.units import G0

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
AXES = ("pitch", "roll", "yaw")

LEGS = 4
"""Legs of one circuit, and passes of a cloverleaf."""


def _aircraft(info: ValidationInfo) -> Aircraft | None:
    return (info.context or {}).get("aircraft")


class Start(Strict):
    """Where and when the first recorded row is flown."""

    lat_deg: float = Field(ge=-89.0, le=89.0, description="WGS-84 latitude")
    lon_deg: float = Field(ge=-180.0, le=180.0, description="WGS-84 longitude")
    alt_m: float = Field(gt=0.0, description="height above the WGS-84 ellipsoid")
    speed_mps: float = Field(gt=0.0, description="true airspeed, held during the flight")
    heading_deg: float = Field(default=0.0, ge=0.0, lt=360.0, description="course of the first leg")
    time_utc: datetime = Field(default=datetime(2025, 3, 13, tzinfo=UTC), description="time of the first row")

    @field_validator("alt_m")
    @classmethod
    def _under_ceiling(cls, value: float, info: ValidationInfo) -> float:
        aircraft = _aircraft(info)
        if aircraft and value > aircraft.limits.alt_m:
            msg = f"{value:g} m is above the ceiling of {aircraft.name}; allowed: up to {aircraft.limits.alt_m:g}"
            raise ValueError(msg)
        return value

    @field_validator("speed_mps")
    @classmethod
    def _in_envelope(cls, value: float, info: ValidationInfo) -> float:
        aircraft = _aircraft(info)
        if aircraft:
            low, high = aircraft.limits.speed_mps
            if not low <= value <= high:
                msg = f"{aircraft.name} cannot hold {value:g} m/s; allowed: {low:g} to {high:g}"
                raise ValueError(msg)
        return value

    @field_validator("time_utc")
    @classmethod
    def _igrf_years(cls, value: datetime) -> datetime:
        if value.tzinfo is None:
            value = value.replace(tzinfo=UTC)
        if not 1900 <= value.year < 2030:
            msg = f"IGRF-14 does not cover the year {value.year}; allowed: 1900 to 2029"
            raise ValueError(msg)
        return value.astimezone(UTC)


class FlightSettings(Strict):
    """How the flight model is run."""

    step_hz: int = Field(default=120, ge=60, le=480, multiple_of=60, description="step rate of JSBSim")
    log_hz: int = Field(default=30, ge=10, le=240, description="log rate of the trajectory; divides step_hz")
    warmup_s: float = Field(default=60.0, ge=30.0, le=600.0, description="flown and thrown away before row 0")

    @field_validator("log_hz")
    @classmethod
    def _divides(cls, value: int, info: ValidationInfo) -> int:
        step = info.data.get("step_hz")
        if value % 10 or (step and step % value):
            msg = f"{value} is not a multiple of 10 that divides step_hz = {step}; allowed: e.g. 10, 20, 30, 60"
            raise ValueError(msg)
        return value


class Train(Strict):
    """A train of sine maneuvers on one axis, flown once on each leg.

    ``amplitude_deg`` (half of peak to peak) and ``period_s`` take one number, or a list that is gone through leg
    by leg over the whole flight.
    """

    axis: Literal["pitch", "roll", "yaw"]
    amplitude_deg: Numbers
    period_s: Numbers = (6.0,)
    cycles: int = Field(default=3, ge=1, le=50)
    rest_s: NonNegative = 6.0

    @field_validator("amplitude_deg")
    @classmethod
    def _within_limit(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        aircraft, axis = _aircraft(info), info.data.get("axis")
        limit = aircraft.limits.amplitude_deg[axis] if aircraft and axis else 45.0
        name = aircraft.name if aircraft else "any aircraft"
        for value in values:
            if not 0.0 < value <= limit:
                msg = f"{value:g} deg is no {axis} amplitude for {name}; allowed: above 0, up to {limit:g}"
                raise ValueError(msg)
        return values

    @field_validator("period_s")
    @classmethod
    def _flyable(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        for value in values:
            if not 3.0 <= value <= 30.0:
                msg = f"{value:g} s is no maneuver period; allowed: 3 to 30"
                raise ValueError(msg)
        return values

    def amplitude(self, index: int) -> float:
        """Amplitude [deg] on the leg with this index, counted from 0 over the whole flight."""
        return self.amplitude_deg[index % len(self.amplitude_deg)]

    def period(self, index: int) -> float:
        """Period [s] on the leg with this index, counted from 0 over the whole flight."""
        return self.period_s[index % len(self.period_s)]

    def duration(self, index: int) -> float:
        """Time that the train takes on that leg, rest included [s]."""
        return self.cycles * self.period(index) + self.rest_s


class PatternBase(Strict):
    """What every pattern of legs has."""

    turn: Literal["right", "left"] = "right"
    bank_deg: float = Field(default=25.0, ge=5.0, le=45.0, description="planned bank of the turns")
    lead_s: NonNegative = 15.0
    maneuvers: tuple[Train, ...] = Field(default=(), strict=False)


class Box(PatternBase):
    """Square circuits: four straight legs at right angles, joined by quarter turns."""

    kind: Literal["box"] = "box"
    circuits: int = Field(default=1, ge=1, le=100)
    leg_m: float = Field(default=10_000.0, ge=500.0, le=200_000.0, description="straight part of each leg")


class Cloverleaf(PatternBase):
    """Four passes over one point, which is the start point, joined by square leaves."""

    kind: Literal["cloverleaf"] = "cloverleaf"
    leaf_m: float = Field(default=5_000.0, ge=3_000.0, le=50_000.0, description="side of the square leaves")

    @property
    def circuits(self) -> int:
        """A cloverleaf is one circuit."""
        return 1

    @property
    def leg_m(self) -> float:
        """Length of a pass [m]: from one leaf over the center to the next, less nothing."""
        return 2.0 * self.leaf_m


Pattern = Annotated[Box | Cloverleaf, Discriminator("kind")]


class Air(Strict):
    """Wind and turbulence."""

    wind_north_mps: float = Field(default=0.0, ge=-30.0, le=30.0, description="where the air moves to: north")
    wind_east_mps: float = Field(default=0.0, ge=-30.0, le=30.0, description="where the air moves to: east")
    turbulence_severity: int = Field(default=0, ge=0, le=7, description="MIL-F-8785C severity, Tustin form")


class Earth(Strict):
    """The main field."""

    model: Literal["igrf14"] = "igrf14"
    along_path: bool = Field(
        default=True, description="false: the field of the start point everywhere, without gradient"
    )


class Part(Strict):
    """A part of the aircraft's field that can be switched and scaled."""

    enabled: bool = True
    scale: float = Field(default=1.0, ge=-1000.0, le=1000.0)


class Eddy(Part):
    """Eddy currents."""

    lag: bool = Field(default=True, description="false: instantaneous, proportional to dB/dt (Tolles-Lawson)")


class Field_(Strict):
    """Which physics is on."""

    earth: Earth = Earth()
    permanent: Part = Part()
    hinged: Part = Part()
    induced: Part = Part()
    eddy: Eddy = Eddy()


class Sensor(Strict):
    """An instrument with a name of its own at a mount of the aircraft."""

    name: Name
    mount: str

    @field_validator("mount")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        aircraft = _aircraft(info)
        if aircraft and value not in aircraft.mounts:
            known = ", ".join(aircraft.mounts)
            msg = f"{aircraft.name} has no mount {value!r}; allowed: {known}"
            raise ValueError(msg)
        return value


class ScalarSensor(Sensor):
    """A total-field magnetometer."""

    noise_nt_rthz: NonNegative = Field(default=0.004, description="white noise density")


class FluxgateSensor(Sensor):
    """A three-axis fluxgate."""

    noise_nt_rthz: NonNegative = Field(default=0.015, description="white noise density of each axis")
    offset_nt: Vector = (0.0, 0.0, 0.0)
    scale_error: Vector = Field(default=(0.0, 0.0, 0.0), description="relative, 0.001 is 0.1 %")
    nonorthogonality_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="angles xy, xz, yz beyond 90")
    misalignment_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="roll, pitch, yaw of the mounting")


class Ins(Strict):
    """Inertial navigation: bias, Gauss-Markov drift and a little white noise on each channel."""

    attitude_bias_deg: Vector = (0.0, 0.0, 0.0)
    attitude_drift_deg: NonNegative = Field(default=0.0, description="standard deviation of the drift")
    attitude_noise_deg: NonNegative = Field(default=0.0, description="white, each row")
    heading_factor: Positive = Field(default=1.0, description="drift and noise of heading over roll and pitch")
    position_drift_m: NonNegative = 0.0
    position_noise_m: NonNegative = 0.0
    velocity_drift_mps: NonNegative = 0.0
    velocity_noise_mps: NonNegative = 0.0
    correlation_s: Positive = 300.0


class Sensors(Strict):
    """All instruments on board."""

    scalar: tuple[ScalarSensor, ...] = Field(min_length=1, strict=False)
    fluxgate: tuple[FluxgateSensor, ...] = Field(default=(), strict=False)
    ins: Ins = Ins()

    @field_validator("scalar", "fluxgate")
    @classmethod
    def _unique(cls, value: tuple[Sensor, ...], info: ValidationInfo) -> tuple[Sensor, ...]:
        names = [sensor.name for sensor in (*(info.data.get("scalar") or ()), *value)]
        double = sorted({name for name in names if names.count(name) > 1})
        if double:
            msg = f"sensor names must differ, used twice: {', '.join(double)}"
            raise ValueError(msg)
        return value


class RecordingSettings(Strict):
    """The rows that are written, and which of them serve for training."""

    rate_hz: int = Field(default=10, ge=5, le=20, description="rows a second; divides flight.step_hz")
    train_circuits: Annotated[tuple[int, ...], Field(strict=False)] = (1,)
    valid_legs: Annotated[tuple[int, ...], Field(strict=False)] = Field(
        default=(4,), description="legs of the training circuits that are kept for validation"
    )


class Scenario(Strict):
    """One flight, complete."""

    schema_: Literal[1] = Field(alias="schema", description="version of this format")
    seed: int = Field(ge=0, lt=2**63, description="every random number comes from it")
    title: str = ""
    aircraft: str = Field(description="name of a folder in aircraft/")
    start: Start
    flight: FlightSettings = FlightSettings()
    pattern: Pattern
    air: Air = Air()
    field: Field_ = Field_()
    sensors: Sensors
    recording: RecordingSettings = RecordingSettings()

    @field_validator("pattern")
    @classmethod
    def _flyable(cls, pattern: Box | Cloverleaf, info: ValidationInfo) -> Box | Cloverleaf:
        start = info.data.get("start")
        if start:
            found = [*_check_fit(pattern, start), *_check_loads(pattern, start, _aircraft(info))]
            if found:
                raise Problems(*found)
        return pattern

    @field_validator("recording")
    @classmethod
    def _rows_exist(cls, recording: RecordingSettings, info: ValidationInfo) -> RecordingSettings:
        found = [*_check_rows(recording, info.data.get("flight"), info.data.get("pattern"))]
        if found:
            raise Problems(*found)
        return recording


def _check_rows(
    recording: RecordingSettings, flight: FlightSettings | None, pattern: Box | Cloverleaf | None
) -> Iterator[tuple[str, str]]:
    """Rows and splits must exist."""
    rate = recording.rate_hz
    if flight and flight.step_hz % rate:
        yield "rate_hz", f"{rate} does not divide flight.step_hz = {flight.step_hz}; allowed: a divisor of it"
    circuits = pattern.circuits if pattern else 100
    for key, values, last in (
        ("train_circuits", recording.train_circuits, circuits),
        ("valid_legs", recording.valid_legs, LEGS),
    ):
        for i, value in enumerate(values):
            if not 1 <= value <= last:
                yield f"{key}[{i}]", f"{value} is not flown; allowed: 1 to {last}"


def _check_fit(pattern: Box | Cloverleaf, start: Start) -> Iterator[tuple[str, str]]:
    """Maneuvers must fit into the legs."""
    available = pattern.leg_m / start.speed_mps
    for leg in range(LEGS * pattern.circuits):
        needed = pattern.lead_s + sum(train.duration(leg) for train in pattern.maneuvers)
        if needed > available:
            text = (
                f"leg {leg + 1} needs {needed:.0f} s for its maneuvers, but a leg of {pattern.leg_m:g} m takes "
                f"{available:.0f} s at {start.speed_mps:g} m/s; allowed: shorter trains or longer legs"
            )
            yield "maneuvers", text
            return


def _check_loads(pattern: Box | Cloverleaf, start: Start, aircraft: Aircraft | None) -> Iterator[tuple[str, str]]:
    """Pitch maneuvers must stay within the aircraft's load factors: 1 g +- V A omega / g."""
    for number, train in enumerate(pattern.maneuvers):
        for leg in range(LEGS * pattern.circuits if aircraft and train.axis == "pitch" else 0):
            amplitude, period = train.amplitude(leg), train.period(leg)
            swing = start.speed_mps * math.radians(amplitude) * 2.0 * math.pi / period / G0
            low, high = aircraft.limits.load_factor
            if not low <= 1.0 - swing or not 1.0 + swing <= high:
                text = (
                    f"{amplitude:g} deg of pitch in {period:g} s swings from {1.0 - swing:.2f} to "
                    f"{1.0 + swing:.2f} g at {start.speed_mps:g} m/s; allowed for {aircraft.name}: "
                    f"{low:g} to {high:g} g (a longer period or a smaller amplitude)"
                )
                yield f"maneuvers[{number}].amplitude_deg", text
                break


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario with all that it refers to: what ``simulate`` takes.

    Attributes
    ----------
    name : str
        Name of the scenario: the file's stem.
    scenario : Scenario
    aircraft : Aircraft
    text : str
        The scenario file as it was read.
    overrides : tuple of str
        ``key.path=value`` settings that were laid over the text.
    """

    name: str
    scenario: Scenario
    aircraft: Aircraft
    text: str
    overrides: tuple[str, ...] = ()

    @cached_property
    def digest(self) -> str:
        """SHA-256 over the meaning of the scenario and the aircraft's files, in hexadecimal.

        Comments, order of keys and values that equal the default do not count.
        """
        meaning = json.dumps(self.scenario.model_dump(mode="json", by_alias=True), sort_keys=True)
        return hashlib.sha256(f"{meaning}\n{self.aircraft.digest}".encode()).hexdigest()


def load_scenario(name_or_path: str | Path, overrides: Sequence[str] = ()) -> LoadedScenario:
    """Read and check a scenario with the aircraft that it flies.

    Parameters
    ----------
    name_or_path : str or Path
        A TOML file, or the name of a shipped scenario with or without ``.toml``.
    overrides : sequence of str
        ``key.path=value`` settings that are laid over the file.

    Returns
    -------
    LoadedScenario

    Raises
    ------
    RequestError
        If anything is wrong: one line for each problem, with file and line.
    """
    path = assets.scenario_path(name_or_path)
    document = config.read(path, overrides=overrides)
    name = document.table.get("aircraft")
    aircraft, also = None, []
    if isinstance(name, str):
        try:
            aircraft = load_aircraft(name)
        except RequestError as error:
            also.append(("aircraft", str(error)))
    scenario = document.validate(Scenario, context={"aircraft": aircraft}, also=also)
    assert aircraft is not None  # else validate had told a problem
    return LoadedScenario(path.stem, scenario, aircraft, document.text, tuple(overrides))
