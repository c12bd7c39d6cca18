"""The instruments on board, and the base station on the ground."""

from pydantic import Field, ValidationInfo, field_validator

from magsim.config import Name, Strict, Vector
from magsim.scenario.base import NonNegative, Positive, aircraft_of
from magsim.scenario.place import Place


class Sensor(Strict):
    """An instrument with a name of its own at a mount of the aircraft."""

    name: Name
    mount: str

    @field_validator("mount")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        aircraft = aircraft_of(info)
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


class Radar(Strict):
    """A radar altimeter: height above the ground below, with noise, -1 where no echo is heard."""

    noise_m: NonNegative = Field(default=0.3, description="white, each row")
    noise_relative: NonNegative = Field(default=0.002, le=0.5, description="white, each row, share of the height")
    max_range_m: Positive = Field(default=760.0, description="no echo from farther away: the reading is -1")
    max_tilt_deg: float = Field(
        default=45.0, gt=0.0, le=90.0, description="no echo beyond this tilt: the reading is -1"
    )


class BaseStation(Place):
    """A scalar magnetometer that stays on the ground; without a place it stands at the start point."""

    name: Name = "ground"
    height_m: NonNegative = Field(default=2.0, le=1000.0, description="above the ground")
    noise_nt_rthz: NonNegative = Field(default=0.01, description="white noise density")
    rate_hz: float = Field(default=1.0, ge=0.5, le=10.0, description="readings a second, joined by straight lines")
    delay_s: float = Field(default=0.0, ge=-2.0, le=2.0, description="its clock tags readings so much too late")


class Electrical(Strict):
    """Current sensors of all circuits and voltmeters of all buses that the aircraft's file names."""

    enabled: bool = Field(default=True, description="false: currents flow, nobody records them")
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
    ins: Ins = Ins()
    electrical: Electrical = Electrical()
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
