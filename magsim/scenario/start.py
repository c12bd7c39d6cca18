"""Where and when a flight begins, and how the flight model is run."""

from datetime import UTC, datetime

from pydantic import Field, ValidationInfo, field_validator

from magsim.config import Strict
from magsim.scenario.base import aircraft_of
from magsim.scenario.flaps import FlapMove, flap_problem


class Start(Strict):
    """Where and when the first recorded row is flown."""

    lat_deg: float = Field(ge=-90.0, le=90.0, description="WGS-84 latitude; 90 and -90 too")
    lon_deg: float = Field(ge=-180.0, le=180.0, description="WGS-84 longitude")
    alt_m: float = Field(gt=0.0, description="height above the WGS-84 ellipsoid")
    speed_mps: float = Field(gt=0.0, description="true airspeed, held during the flight")
    heading_deg: float = Field(default=0.0, ge=0.0, lt=360.0, description="course of the first leg")
    flap_deg: float = Field(default=0.0, ge=0.0, le=90.0, description="of the flaps; flight.flaps moves them")
    time_utc: datetime = Field(default=datetime(2025, 3, 13, tzinfo=UTC), description="time of the first row")

    @field_validator("alt_m")
    @classmethod
    def _under_ceiling(cls, value: float, info: ValidationInfo) -> float:
        aircraft = aircraft_of(info)
        if aircraft and value > aircraft.limits.alt_m:
            msg = f"{value:g} m is above the ceiling of {aircraft.name}; allowed: up to {aircraft.limits.alt_m:g}"
            raise ValueError(msg)
        return value

    @field_validator("speed_mps")
    @classmethod
    def _in_envelope(cls, value: float, info: ValidationInfo) -> float:
        aircraft = aircraft_of(info)
        if aircraft:
            low, high = aircraft.limits.speed_mps
            if not low <= value <= high:
                msg = f"{aircraft.name} cannot hold {value:g} m/s; allowed: {low:g} to {high:g}"
                raise ValueError(msg)
        return value

    @field_validator("flap_deg")
    @classmethod
    def _flaps_bear_it(cls, value: float, info: ValidationInfo) -> float:
        aircraft = aircraft_of(info)
        msg = flap_problem(aircraft, value, info.data.get("speed_mps"), info.data.get("alt_m")) if aircraft else ""
        if msg:
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


class Sway(Strict):
    """How far air and hands move a kinematic carrier, standard deviations; without a key, that of its file."""

    lateral_m: float | None = Field(default=None, ge=0.0, le=20.0, description="across the line: roll follows from it")
    vertical_m: float | None = Field(default=None, ge=0.0, le=20.0, description="in height")
    along_m: float | None = Field(default=None, ge=0.0, le=20.0, description="along the line: pitch follows from it")
    heading_deg: float | None = Field(
        default=None, ge=0.0, le=20.0, description="of the nose, beside the heading that follows the bank"
    )


class FlightSettings(Strict):
    """How the flight model is run."""

    step_hz: int = Field(default=120, ge=60, le=960, multiple_of=60, description="step rate of JSBSim")
    log_hz: int | None = Field(
        default=None,
        ge=10,
        le=240,
        description="log rate of the trajectory; divides step_hz; without it what the aircraft's fastest motion needs",
    )
    warmup_s: float = Field(default=60.0, ge=30.0, le=600.0, description="flown before row 0 and not recorded")
    leg_tolerance_m: float = Field(default=300.0, gt=0.0, description="a leg flown farther from its line is missed")
    surface_saturation_s: float = Field(
        default=3.0, gt=0.0, description="elevator, aileron or rudder at a stop for longer ends the flight"
    )
    throttle_saturation_s: float = Field(
        default=30.0,
        gt=0.0,
        description="full or idle throttle for longer, with the airspeed off by 3 %, ends the flight",
    )
    sway: Sway | None = Field(default=None, description="of a kinematic carrier")
    flaps: tuple[FlapMove, ...] = Field(default=(), strict=False, description="settings of the flap lever in flight")

    @field_validator("log_hz")
    @classmethod
    def _divides(cls, value: int | None, info: ValidationInfo) -> int | None:
        step = info.data.get("step_hz")
        if value is not None and (value % 10 or (step and step % value)):
            msg = f"{value} is not a multiple of 10 that divides step_hz = {step}; allowed: e.g. 10, 20, 30, 60"
            raise ValueError(msg)
        return value
