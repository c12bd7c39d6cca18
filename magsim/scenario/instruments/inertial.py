"""Inertial navigation."""

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator

from magsim.aircraft import reach_m
from magsim.config import Vector
from magsim.scenario.base import NonNegative, Positive, PresetTable, aircraft_of, bird_of
from magsim.scenario.instruments.common import InstrumentClock

UNITS: Mapping[str, Mapping[str, object]] = {
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
}
"""Values by the name of the preset; docs/instruments.md names their sources."""


class Ins(InstrumentClock, PresetTable):
    """Inertial navigation: bias, Gauss-Markov drift and a little white noise on each channel.

    Attitude, position and velocity are what it computes; ``acc`` and ``rate`` what its accelerometers and gyros read.
    """

    PRESETS: ClassVar[Mapping[str, Mapping[str, object]]] = UNITS
    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "heading_recovery_s": ("heading_coupling",),
        "heading_factor": ("attitude_drift_deg", "attitude_noise_deg"),
        "correlation_s": ("attitude_drift_deg", "position_drift_m", "velocity_drift_mps"),
        "acc_correlation_s": ("acc_drift_mps2",),
        "rate_correlation_s": ("rate_drift_dps",),
    }

    preset: Literal["ins_survey", "ins_mems"] | None = None
    position_m: Vector | None = Field(
        default=None, description="place in the body, from its datum; left out: at the center of gravity"
    )
    lever_error_m: Vector = Field(
        default=(0.0, 0.0, 0.0), description="how far from its place it takes itself to be, body axes"
    )
    heading_coupling: Vector = Field(
        default=(0.0, 0.0, 0.0), description="error of heading for each degree turned about x, y, z: 0.001 is 0.1 %"
    )
    heading_recovery_s: Positive = Field(default=60.0, description="time constant with which that error decays")
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

    @field_validator("position_m", "lever_error_m")
    @classmethod
    def _in_the_hull(cls, value: Vector | None, info: ValidationInfo) -> Vector | None:
        bodies = [vehicle for vehicle in (aircraft_of(info), bird_of(info)) if vehicle]
        most = max((reach_m(vehicle.facts) for vehicle in bodies), default=float("inf"))
        if value is not None and max(map(abs, value)) > most:
            msg = f"{list(value)} is off the hull; allowed: {-most:g} to {most:g} m on each axis"
            raise ValueError(msg)
        return value
