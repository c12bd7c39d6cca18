"""Fluxgates, and the temperature of the cabin that they drift with."""

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from magsim.config import Strict, Vector
from magsim.scenario.base import NonNegative, Positive, PresetTable
from magsim.scenario.instruments.common import InstrumentClock, Sensor

FLUXGATES: Mapping[str, Mapping[str, object]] = {
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
}
"""Values by the name of the preset; docs/instruments.md names their sources."""

MOST_FLEXURE_DEG_G = 10.0
"""Largest bending of an airframe that is believed, each g: 25 times what is plausible (estimate)."""


class FluxgateSensor(Sensor, InstrumentClock, PresetTable):
    """A three-axis fluxgate: docs/instruments.md."""

    PRESETS: ClassVar[Mapping[str, Mapping[str, object]]] = FLUXGATES
    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"reference_c": ("offset_drift_nt_c", "scale_drift_ppm_c")}

    preset: Literal["fluxgate_survey"] | None = None
    noise_nt_rthz: NonNegative = Field(default=0.015, description="white noise density of each axis")
    flicker_nt_rthz: NonNegative = Field(
        default=0.0, le=100.0, description="density of the 1/f noise of each axis at 1 Hz"
    )
    offset_nt: Vector = (0.0, 0.0, 0.0)
    scale_error: Vector = Field(default=(0.0, 0.0, 0.0), description="relative, 0.001 is 0.1 %")
    nonorthogonality_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="angles xy, xz, yz beyond 90")
    misalignment_deg: Vector = Field(default=(0.0, 0.0, 0.0), description="roll, pitch, yaw of the mounting")
    refit: int = Field(
        default=0,
        ge=0,
        le=10_000,
        description="how often it was taken off and put back: each draws a misalignment more",
    )
    flexure_deg_g: Vector = Field(
        default=(0.0, 0.0, 0.0),
        description="turn about x, y, z against the INS for each g beyond 1, as the airframe between bends",
    )
    cross_field_nt: Vector = Field(default=(0.0, 0.0, 0.0), description="error of each axis in 50 000 nT across it")
    offset_drift_nt_c: Vector = Field(default=(0.0, 0.0, 0.0), description="offset for each degree of the cabin")
    scale_drift_ppm_c: Vector = Field(default=(0.0, 0.0, 0.0), description="scale for each degree of the cabin")
    reference_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="where the drifts are zero")
    bandwidth_hz: Positive | None = Field(default=None, ge=0.5, description="-3 dB, first order; without it, no limit")
    range_nt: Positive | None = Field(default=None, description="largest reading of an axis, either sign")
    step_nt: NonNegative = Field(default=0.0, le=1000.0, description="least count; 0: none")

    @field_validator("flexure_deg_g")
    @classmethod
    def _bends_as_an_airframe(cls, value: Vector) -> Vector:
        if max(map(abs, value)) > MOST_FLEXURE_DEG_G:
            most = MOST_FLEXURE_DEG_G
            msg = f"{list(value)} is more than an airframe bends; allowed: {-most:g} to {most:g} on each axis"
            raise ValueError(msg)
        return value


class Cabin(Strict):
    """Temperature of the instruments: an approach of first order, and a slow wander from the seed."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"wander_s": ("wander_c",)}

    start_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="at the first row")
    settled_c: float = Field(default=20.0, ge=-60.0, le=80.0, description="after a long time")
    warmup_s: Positive = Field(default=1200.0, description="time constant of the approach")
    wander_c: NonNegative = Field(default=0.0, le=20.0, description="standard deviation of the wander")
    wander_s: Positive = Field(default=300.0, description="correlation time of the wander")
