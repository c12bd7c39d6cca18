"""Channels of the aircraft's own state: currents and voltages of its wiring."""

from pydantic import Field

from magsim.scenario.base import NonNegative
from magsim.scenario.instruments.common import InstrumentClock


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
