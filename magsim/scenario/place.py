"""Places on the ground."""

from pydantic import Field, model_validator

from magsim.config import Strict

WAYS_TO_GIVE = "either lat_deg and lon_deg, or north_m and east_m"


class GroundPoint(Strict):
    """A place on the ground: latitude and longitude, or meters from the start point."""

    lat_deg: float | None = Field(default=None, ge=-90.0, le=90.0, description="WGS-84; with lon_deg")
    lon_deg: float | None = Field(default=None, ge=-180.0, le=180.0, description="WGS-84; with lat_deg")
    north_m: float | None = Field(default=None, ge=-300_000.0, le=300_000.0, description="of the start; with east_m")
    east_m: float | None = Field(default=None, ge=-300_000.0, le=300_000.0, description="of the start; with north_m")

    @property
    def given(self) -> bool:
        """Whether a place is given at all."""
        return self.lat_deg is not None or self.north_m is not None

    @model_validator(mode="after")
    def _whole(self) -> "GroundPoint":
        present = [value is not None for value in (self.lat_deg, self.lon_deg, self.north_m, self.east_m)]
        if present not in ([False] * 4, [True, True, False, False], [False, False, True, True]):
            msg = f"a place is given twice or only in part; allowed: {WAYS_TO_GIVE}"
            raise ValueError(msg)
        return self
