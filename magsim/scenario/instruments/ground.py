"""The base station on the ground."""

from pydantic import Field

from magsim.config import Name
from magsim.scenario.base import NonNegative
from magsim.scenario.place import GroundPoint


class BaseStation(GroundPoint):
    """A scalar magnetometer that stays on the ground; without a place it stands at the start point."""

    name: Name = "ground"
    height_m: NonNegative = Field(default=2.0, le=1000.0, description="above the ground")
    noise_nt_rthz: NonNegative = Field(default=0.01, description="white noise density")
    rate_hz: float = Field(default=1.0, ge=0.5, le=10.0, description="readings a second, joined by straight lines")
    delay_s: float = Field(default=0.0, ge=-2.0, le=2.0, description="its clock tags readings so much too late")
    jitter_s: NonNegative = Field(default=0.0, le=0.01, description="standard deviation of each tag")
    drift_ppm: float = Field(default=0.0, ge=-200.0, le=200.0, description="growth of the delay, microseconds a s")
