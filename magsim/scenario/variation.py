"""Time variation of the field by ionosphere and magnetosphere, the same over a whole survey."""

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field

from magsim.config import Strict, Vector
from magsim.scenario.base import NonNegative, Positive


class Variation(Strict):
    """Daily variation, pulsations and drift; vectors north, east, down."""

    NEEDS: ClassVar[Mapping[str, tuple[str, ...]]] = {"drift_s": ("drift_nt",)}

    enabled: bool = True
    sq_nt: Vector = Field(
        default=(20.0, 40.0, 20.0),
        description="daily variation, peak to peak over a day; a minus turns it over",
    )
    pc3_nt: NonNegative = Field(default=0.5, le=1000.0, description="largest packets with periods of 10 to 45 s")
    pc4_nt: NonNegative = Field(default=1.0, le=1000.0, description="largest packets with periods of 45 to 150 s")
    pc5_nt: NonNegative = Field(default=2.0, le=1000.0, description="largest packets with periods of 150 to 600 s")
    drift_nt: NonNegative = Field(default=1.0, le=1000.0, description="standard deviation of the drift, each component")
    drift_s: Positive = Field(default=600.0, description="correlation time of the drift")
