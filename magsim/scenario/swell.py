"""Waves of the sea below the flight, and what they make of the field."""

from pydantic import Field

from magsim.config import Strict
from magsim.scenario.base import NonNegative, Positive


class Swell(Strict):
    """Sea water that moves through the main field carries currents, whose field falls off with height."""

    enabled: bool = True
    height_m: Positive = Field(default=2.0, le=20.0, description="significant height of the waves, crest to trough")
    period_s: float = Field(default=12.0, ge=4.0, le=25.0, description="of the peak of their spectrum")
    heading_deg: float = Field(default=0.0, ge=0.0, lt=360.0, description="where they run to, clockwise from north")
    peak: float = Field(default=5.0, ge=1.0, le=10.0, description="JONSWAP's gamma: 3.3 in a growing sea, swell more")
    spread: NonNegative = Field(
        default=50.0,
        le=200.0,
        description="Goda's largest s, more is narrower: 10 wind waves, 25 to 75 swell",
    )
    waves: int = Field(default=96, ge=8, le=1024, description="number of plane waves")
    conductivity_spm: Positive = Field(default=4.4, le=10.0, description="of the water, S/m")
    seed: int | None = Field(default=None, ge=0, lt=2**63, description="of the waves alone; without it the scenario's")
