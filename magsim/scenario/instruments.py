"""The instruments on board, and the base station on the ground."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from magsim.config import Name, Strict, Vector
from magsim.scenario.base import NonNegative, Positive, aircraft_of, bird_of
from magsim.scenario.place import GroundPoint

Heading = Annotated[float, Field(ge=-100.0, le=100.0)]

Range = Annotated[
    tuple[float, float], BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
]
"""Least and largest value."""

PRESETS: Mapping[str, Mapping[str, Mapping[str, object]]] = {
    "ScalarSensor": {
        "cs_vapor": {
            "noise_nt_rthz": 0.004,
            "heading_cos_nt": 0.05,
            "heading_cos2_nt": 0.05,
            "heading_switch_nt": 0.05,
            "gyro_shift": 1.0,
            "counter_s": 0.1,
            "step_nt": 0.001,
            "dead_polar_deg": 15.0,
            "dead_equator_deg": 15.0,
            "relock_s": 0.5,
            "range_nt": [20_000.0, 100_000.0],
        }
    },
    "FluxgateSensor": {
        "fluxgate_survey": {
            "noise_nt_rthz": 0.015,
            "offset_nt": [30.0, -20.0, 40.0],
            "scale_error": [0.002, -0.0015, 0.001],
            "nonorthogonality_deg": [0.2, -0.15, 0.25],
            "misalignment_deg": [0.4, -0.3, 0.6],
            "cross_field_nt": [10.0, -10.0, 10.0],
            "offset_drift_nt_c": [0.1, -0.1, 0.1],
            "scale_drift_ppm_c": [20.0, 20.0, 20.0],
            "bandwidth_hz": 100.0,
            "range_nt": 100_000.0,
            "step_nt": 0.1,
        }
    },
    "Ins": {
        "ins_survey": {
            "attitude_bias_deg": [0.01, -0.01, 0.03],
            "attitude_drift_deg": 0.01,
            "attitude_noise_deg": 0.002,
            "heading_factor": 2.0,
            "position_drift_m": 1.0,
            "position_noise_m": 0.05,
            "velocity_drift_mps": 0.01,
            "velocity_noise_mps": 0.005,
            "correlation_s": 300.0,
            "acc_bias_mps2": [2e-4, -2e-4, 3e-4],
            "acc_scale_error": [5e-5, -5e-5, 5e-5],
            "acc_drift_mps2": 2.45e-4,
            "acc_correlation_s": 3600.0,
            "acc_noise_mps2_rthz": 3.4e-4,
            "rate_bias_dps": [1e-6, -1e-6, 1e-6],
            "rate_scale_error": [5e-6, -5e-6, 5e-6],
            "rate_drift_dps": 4.2e-7,
            "rate_correlation_s": 3600.0,
            "rate_noise_dps_rthz": 4.7e-5,
        },
        "ins_mems": {
            "attitude_bias_deg": [0.15, -0.1, 0.4],
            "attitude_drift_deg": 0.15,
            "attitude_noise_deg": 0.02,
            "heading_factor": 3.0,
            "position_drift_m": 2.0,
            "position_noise_m": 0.2,
            "velocity_drift_mps": 0.05,
            "velocity_noise_mps": 0.02,
            "correlation_s": 120.0,
            "skew_s": 0.02,
            "acc_bias_mps2": [0.02, -0.02, 0.03],
            "acc_scale_error": [1e-3, -1e-3, 1e-3],
            "acc_drift_mps2": 6.4e-4,
            "acc_correlation_s": 300.0,
            "acc_noise_mps2_rthz": 1.4e-3,
            "rate_bias_dps": [0.02, -0.02, 0.02],
            "rate_scale_error": [1e-3, -1e-3, 1e-3],
            "rate_drift_dps": 3e-3,
            "rate_correlation_s": 300.0,
            "rate_noise_dps_rthz": 3.5e-3,
        },
    },
}
"""Values by kind of table and name; docs/instruments.md names their sources."""


class Sensor(Strict):
    """An instrument with a name of its own at a mount of the aircraft, or of the bird that it tows."""

    name: Name
    body: Literal["carrier", "bird"] = Field(default="carrier", description="what carries it")
    mount: str

    @field_validator("mount")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        vehicle = bird_of(info) if info.data.get("body") == "bird" else aircraft_of(info)
        if vehicle and value not in vehicle.mounts:
            known = ", ".join(vehicle.mounts)
            msg = f"{vehicle.name} has no mount {value!r}; allowed: {known}"
            raise ValueError(msg)
        return value


class InstrumentClock(Strict):
    """When the values of a row were taken: ``t - skew_s - drift_ppm 1e-6 t - jitter`` for the tag ``t``."""

    skew_s: float = Field(default=0.0, ge=-0.5, le=0.5, description="how late the reading is; labels are at the tag")
    jitter_s: NonNegative = Field(default=0.0, le=0.02, description="standard deviation, white from row to row")
    drift_ppm: float = Field(default=0.0, ge=-200.0, le=200.0, description="growth of the lateness, microseconds a s")


class PresetTable(Strict):
    """A table whose ``preset`` names values for the keys that it leaves out."""

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, value: object) -> object:
        if isinstance(value, Mapping) and isinstance(value.get("preset"), str):
            return {**PRESETS[cls.__name__].get(value["preset"], {}), **value}
        return value


class ScalarSensor(Sensor, InstrumentClock, PresetTable):
    """A total-field magnetometer: docs/instruments.md."""

    preset: Literal["cs_vapor"] | None = None
    noise_nt_rthz: NonNegative = Field(default=0.004, description="white noise density")
    axis_b: Vector = Field(default=(0.0, 0.0, 1.0), description="direction of the optical axis, body axes")
    heading_cos_nt: Heading = Field(default=0.0, description="times cos of the angle between axis and field")
    heading_cos2_nt: Heading = Field(default=0.0, description="times cos of twice that angle")
    heading_switch_nt: Heading = Field(default=0.0, description="added ahead of the axis's equator, taken off behind")
    gyro_shift: float = Field(default=0.0, ge=-1.0, le=1.0, description="share and sign of the Larmor shift by turning")
    lag_s: NonNegative = Field(default=0.0, le=0.5, description="time constant of first order")
    counter_s: NonNegative = Field(
        default=0.0, le=1.0, description="counting window; 0: the recording's filter instead"
    )
    counter_tag: Literal["center", "end"] = Field(default="center", description="where in the window the tag is")
    step_nt: NonNegative = Field(default=0.0, le=100.0, description="least count; 0: none")
    dead_polar_deg: NonNegative = Field(default=0.0, le=45.0, description="no reading closer to the axis; 0: none")
    dead_equator_deg: NonNegative = Field(default=0.0, le=45.0, description="no reading closer to its equator; 0: none")
    relock_s: NonNegative = Field(default=0.0, le=60.0, description="no reading for so long after a dead zone")
    range_nt: Range | None = Field(default=None, description="least and largest field that is read")

    @field_validator("axis_b")
    @classmethod
    def _points(cls, value: Vector) -> Vector:
        if not any(value):
            msg = "(0, 0, 0) points nowhere; allowed: a direction of any length but 0"
            raise ValueError(msg)
        return value

    @field_validator("range_nt")
    @classmethod
    def _ordered(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and not 0.0 <= value[0] < value[1]:
            msg = f"{list(value)} is no range; allowed: [least, largest], from 0 nT up"
            raise ValueError(msg)
        return value

    @property
    def can_drop_out(self) -> bool:
        """Whether there are fields that it does not read: then rows carry ``mag_{sensor}_valid``."""
        return self.dead_polar_deg > 0.0 or self.dead_equator_deg > 0.0 or self.range_nt is not None


class FluxgateSensor(Sensor, InstrumentClock, PresetTable):
    """A three-axis fluxgate: docs/instruments.md."""

    preset: Literal["fluxgate_survey"] | None = None
    noise_nt_rthz: NonNegative = Field(default=0.015, description="white noise density of each axis")
    offset_nt: Vector = (0.0, 0.0, 0.0)
    scale_error: Vector = Field(default=(0.0, 0.0, 0.0), description="relative, 0.001 is 0.1 %")
    nonorthogonality_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="angles xy, xz, yz beyond 90")
    misalignment_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="roll, pitch, yaw of the mounting")
    cross_field_nt: Vector = Field(default=(0.0, 0.0, 0.0), description="error of each axis in 50 000 nT across it")
    offset_drift_nt_c: Vector = Field(default=(0.0, 0.0, 0.0), description="offset for each degree of the cabin")
    scale_drift_ppm_c: Vector = Field(default=(0.0, 0.0, 0.0), description="scale for each degree of the cabin")
    reference_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="where the drifts are zero")
    bandwidth_hz: Positive | None = Field(default=None, ge=0.5, description="-3 dB, first order; without it, no limit")
    range_nt: Positive | None = Field(default=None, description="largest reading of an axis, either sign")
    step_nt: NonNegative = Field(default=0.0, le=1000.0, description="least count; 0: none")


class Cabin(Strict):
    """Temperature of the instruments: an approach of first order, and a slow wander from the seed."""

    start_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="at the first row")
    settled_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="after a long time")
    warmup_s: Positive = Field(default=1200.0, description="time constant of the approach")
    wander_c: NonNegative = Field(default=0.0, le=20.0, description="standard deviation of the wander")
    wander_s: Positive = Field(default=300.0, description="correlation time of the wander")


class Ins(InstrumentClock, PresetTable):
    """Inertial navigation: bias, Gauss-Markov drift and a little white noise on each channel.

    Attitude, position and velocity are what it computes; ``acc`` and ``rate`` what its accelerometers and gyros read.
    """

    preset: Literal["ins_survey", "ins_mems"] | None = None
    attitude_bias_deg: Vector = (0.0, 0.0, 0.0)
    attitude_drift_deg: NonNegative = Field(default=0.0, description="standard deviation of the drift")
    attitude_noise_deg: NonNegative = Field(default=0.0, description="white, each row")
    heading_factor: Positive = Field(default=1.0, description="drift and noise of heading over roll and pitch")
    position_drift_m: NonNegative = 0.0
    position_noise_m: NonNegative = 0.0
    velocity_drift_mps: NonNegative = 0.0
    velocity_noise_mps: NonNegative = 0.0
    correlation_s: Positive = 300.0
    acc_bias_mps2: Vector = (0.0, 0.0, 0.0)
    acc_scale_error: Vector = Field(default=(0.0, 0.0, 0.0), description="relative, 0.001 is 0.1 %")
    acc_drift_mps2: NonNegative = Field(default=0.0, description="standard deviation of the drift of each axis")
    acc_correlation_s: Positive = 300.0
    acc_noise_mps2_rthz: NonNegative = Field(default=0.0, description="white noise density")
    acc_step_mps2: NonNegative = Field(default=0.0, le=1.0, description="least count; 0: none")
    rate_bias_dps: Vector = (0.0, 0.0, 0.0)
    rate_scale_error: Vector = Field(default=(0.0, 0.0, 0.0), description="relative, 0.001 is 0.1 %")
    rate_drift_dps: NonNegative = Field(default=0.0, description="standard deviation of the drift of each axis")
    rate_correlation_s: Positive = 300.0
    rate_noise_dps_rthz: NonNegative = Field(default=0.0, description="white noise density")
    rate_step_dps: NonNegative = Field(default=0.0, le=1.0, description="least count; 0: none")


Qnh = Annotated[float, Field(ge=85_000.0, le=110_000.0)]


class Barometer(InstrumentClock):
    """A barometer: static pressure, and the height of the standard atmosphere that belongs to it."""

    qnh_pa: Qnh = Field(default=101_325.0, description="pressure of the day at the sea")
    setting_pa: Qnh = Field(default=101_325.0, description="pressure that the height is counted from")
    offset_pa: float = Field(default=0.0, ge=-2000.0, le=2000.0, description="constant error")
    drift_pa: NonNegative = Field(default=0.0, le=1000.0, description="standard deviation of the drift")
    correlation_s: Positive = 3600.0
    noise_pa_rthz: NonNegative = Field(default=0.5, description="white noise density")
    lag_s: NonNegative = Field(default=0.0, le=1.0, description="time constant of first order")
    step_pa: NonNegative = Field(default=0.0, le=1000.0, description="least count; 0: none")


class Radar(InstrumentClock):
    """A radar altimeter: height above the ground below, with noise; -1 without an echo."""

    noise_m: NonNegative = Field(default=0.3, description="white, each row")
    noise_relative: NonNegative = Field(default=0.002, le=0.5, description="white, each row, share of the height")
    max_range_m: Positive = Field(default=760.0, description="no echo from farther away: the reading is -1")
    max_tilt_deg: float = Field(
        default=45.0, gt=0.0, le=90.0, description="no echo beyond this tilt: the reading is -1"
    )


class BaseStation(GroundPoint):
    """A scalar magnetometer that stays on the ground; without a place it stands at the start point."""

    name: Name = "ground"
    height_m: NonNegative = Field(default=2.0, le=1000.0, description="above the ground")
    noise_nt_rthz: NonNegative = Field(default=0.01, description="white noise density")
    rate_hz: float = Field(default=1.0, ge=0.5, le=10.0, description="readings a second, joined by straight lines")
    delay_s: float = Field(default=0.0, ge=-2.0, le=2.0, description="its clock tags readings so much too late")
    jitter_s: NonNegative = Field(default=0.0, le=0.01, description="standard deviation of each tag")
    drift_ppm: float = Field(default=0.0, ge=-200.0, le=200.0, description="growth of the delay, microseconds a s")


class Electrical(InstrumentClock):
    """Current sensors of all feeders and voltmeters of all buses that the aircraft's file names."""

    enabled: bool = Field(default=True, description="false: currents flow and are not recorded")
    current_noise_a_rthz: NonNegative = Field(default=0.002, description="white noise density")
    current_offset_a: NonNegative = Field(
        default=0.05, description="standard deviation between channels, constant in each"
    )
    current_step_a: NonNegative = Field(default=0.02, description="least count; 0: none")
    voltage_noise_v_rthz: NonNegative = Field(default=0.0005, description="white noise density")
    voltage_offset_v: NonNegative = Field(
        default=0.02, description="standard deviation between channels, constant in each"
    )
    voltage_step_v: NonNegative = Field(default=0.01, description="least count; 0: none")


class Sensors(Strict):
    """All instruments."""

    scalar: tuple[ScalarSensor, ...] = Field(min_length=1, strict=False)
    fluxgate: tuple[FluxgateSensor, ...] = Field(default=(), strict=False)
    ins: Ins = Field(default=Ins(), description="in the bird where one is towed, else in the carrier")
    carrier_ins: Ins | None = Field(default=None, description="a second one, in the carrier of a bird")
    cabin: Cabin | None = Field(default=None, description="without it, every instrument has its reference_c")
    electrical: Electrical = Electrical()
    barometer: Barometer | None = None
    radar: Radar | None = Field(default=None, description="needs [terrain]")
    base: BaseStation | None = Field(default=None, description="on the ground, for the diurnal correction")

    @field_validator("scalar", "fluxgate")
    @classmethod
    def _unique(cls, value: tuple[Sensor, ...], info: ValidationInfo) -> tuple[Sensor, ...]:
        names = [sensor.name for sensor in (*(info.data.get("scalar") or ()), *value)]
        double = sorted({name for name in names if names.count(name) > 1})
        if double:
            msg = f"sensor names must differ, used twice: {', '.join(double)}"
            raise ValueError(msg)
        return value

    @property
    def of_bird(self) -> tuple[str, ...]:
        """Keys of the instruments in the bird."""
        tables = (("scalar", self.scalar), ("fluxgate", self.fluxgate))
        return tuple(f"{key}[{i}].body" for key, table in tables for i, s in enumerate(table) if s.body == "bird")
