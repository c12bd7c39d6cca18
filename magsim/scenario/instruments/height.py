"""Instruments that measure height: barometer and radar altimeter."""

from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from magsim.scenario.base import NonNegative, Positive
from magsim.scenario.instruments.common import InstrumentClock

Qnh = Annotated[float, Field(ge=85_000.0, le=110_000.0)]


class Barometer(InstrumentClock):
    """A barometer: static pressure, and the height of the standard atmosphere that belongs to it."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"correlation_s": ("drift_pa",)}

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
