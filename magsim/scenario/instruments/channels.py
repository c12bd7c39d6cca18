"""Channels of the aircraft's own state: currents and voltages of its wiring, positions of its control surfaces."""

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from magsim.aircraft.magnetics import Surface
from magsim.config import Name
from magsim.scenario.base import NonNegative, aircraft_of, bird_of
from magsim.scenario.instruments.common import InstrumentClock


class Electrical(InstrumentClock):
    """Current sensors of all feeders and voltmeters of all buses that the aircraft's file names."""

    enabled: bool = Field(default=True, description="false: currents flow and are not recorded")
    without: Annotated[tuple[Name, ...], Field(strict=False)] = Field(
        default=(), description="feeders without a current sensor; the truth has them all"
    )
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

    @field_validator("without")
    @classmethod
    def _feeders_exist(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        vehicles = [vehicle for vehicle in (aircraft_of(info), bird_of(info)) if vehicle]
        known = [feeder.name for vehicle in vehicles for feeder in vehicle.magnetics.feeders]
        strange = [name for name in value if vehicles and name not in known]
        if strange:
            msg = f"there is no feeder {', '.join(map(repr, strange))}; allowed: {', '.join(known) or 'none'}"
            raise ValueError(msg)
        return value


class Surfaces(InstrumentClock):
    """A potentiometer at each control surface that the flight logs."""

    enabled: bool = Field(default=True, description="false: surfaces move and are not recorded")
    without: Annotated[tuple[Surface, ...], Field(strict=False)] = Field(
        default=(), description="surfaces without a potentiometer; the truth has them all"
    )
    noise_deg_rthz: NonNegative = Field(default=0.01, le=10.0, description="white noise density")
    offset_deg: NonNegative = Field(
        default=0.3, le=10.0, description="standard deviation between channels, constant in each"
    )
    scale_error: NonNegative = Field(
        default=0.005, le=0.5, description="standard deviation between channels, constant in each; 0.01 is 1 %"
    )
    backlash_deg: NonNegative = Field(
        default=0.1, le=10.0, description="how far the surface turns back before its potentiometer follows"
    )
    lag_s: NonNegative = Field(default=0.016, le=0.5, description="time constant of first order")
    step_deg: NonNegative = Field(default=0.1, le=10.0, description="least count; 0: none")
