"""Scalar magnetometers on board."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from magsim.config import Strict, Vector
from magsim.scenario.base import NonNegative, Positive, PresetTable
from magsim.scenario.instruments.common import InstrumentClock, Sensor, points_somewhere

Heading = Annotated[float, Field(ge=-100.0, le=100.0)]

Range = Annotated[
    tuple[float, float], BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
]
"""Least and largest value."""

SCALARS: Mapping[str, Mapping[str, object]] = {
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
    },
    "cs_quiet": {
        "noise_nt_rthz": 0.0006,
        "flicker_nt_rthz": 0.0003,
        "heading_cos_nt": 0.07,
        "heading_cos2_nt": 0.07,
        "heading_switch_nt": 0.06,
        "gyro_shift": 1.0,
        "counter_s": 0.1,
        "step_nt": 0.0001,
        "dead_polar_deg": 10.0,
        "dead_equator_deg": 10.0,
        "relock_s": 0.5,
        "range_nt": [15_000.0, 105_000.0],
    },
}
"""Values by the name of the preset; docs/instruments.md names their sources."""


class Tone(Strict):
    """A field that swings faster than the rows, as of mains on the ground or the supply of 400 Hz on board."""

    frequency_hz: Positive = Field(le=1e5, description="what counts is how far it is from whole periods in counter_s")
    amplitude_nt: NonNegative = Field(le=1e5, description="of the swinging field")
    axis_b: Vector | None = Field(
        default=None, description="its direction, body axes; left out: along the main field, whatever the attitude"
    )

    _points = field_validator("axis_b")(points_somewhere)


class ScalarSensor(Sensor, InstrumentClock, PresetTable):
    """A total-field magnetometer: docs/instruments.md."""

    PRESETS: ClassVar[Mapping[str, Mapping[str, object]]] = SCALARS
    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "axis_b": ("heading_cos_nt", "heading_cos2_nt", "heading_switch_nt", "dead_polar_deg", "dead_equator_deg"),
        "counter_tag": ("counter_s",),
        "relock_s": ("dead_polar_deg", "dead_equator_deg", "range_nt"),
    }

    preset: Literal["cs_vapor", "cs_quiet"] | None = None
    noise_nt_rthz: NonNegative = Field(default=0.004, description="white noise density")
    flicker_nt_rthz: NonNegative = Field(default=0.0, le=100.0, description="density of the 1/f noise at 1 Hz")
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
    tones: tuple[Tone, ...] = Field(
        default=(), strict=False, max_length=20, description="hum that the counting window folds; needs counter_s"
    )
    step_nt: NonNegative = Field(default=0.0, le=100.0, description="least count; 0: none")
    dead_polar_deg: NonNegative = Field(default=0.0, le=45.0, description="no reading closer to the axis; 0: none")
    dead_equator_deg: NonNegative = Field(default=0.0, le=45.0, description="no reading closer to its equator; 0: none")
    relock_s: NonNegative = Field(default=0.0, le=60.0, description="no reading for so long after a dead zone")
    range_nt: Range | None = Field(default=None, description="least and largest field that is read")

    _points = field_validator("axis_b")(points_somewhere)

    @field_validator("tones")
    @classmethod
    def _counted(cls, value: tuple[Tone, ...], info: ValidationInfo) -> tuple[Tone, ...]:
        if value and info.data.get("counter_s") == 0.0:
            msg = "without counter_s the recording's filter lets no tone through; allowed: with counter_s above 0"
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
