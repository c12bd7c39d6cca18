"""Where and how a flight model begins."""

import math
from dataclasses import dataclass

from magsim.flight.model.weather import CALM, Weather


@dataclass(frozen=True)
class PlantSetup:
    """Where and how a plant begins.

    Attributes
    ----------
    lat_rad, lon_rad, alt_m : float
    course : float [rad]
        Of the motion over ground.
    speed_mps : float
        True airspeed.
    wind_mps : (float, float)
        The motion of the air to north and to east; near the poles as they are at ``grid_lon``.
    step_hz : int
    ground_m : float
        Height of the ground above the ellipsoid there.
    weather : Weather
        Motion of the air beside its steady wind.
    flap_rad : float
        Deflection of the flaps at the start.
    burn : bool
        Whether fuel is burned.
    grid : float
        Part of the longitude that is added to headings, see ``magsim.earth.grid``.
    grid_lon : float [rad]
        Longitude of the start point.
    hook_b : (3,) [m], optional
        Where a rope pulls, body axes from the datum.
    """

    lat_rad: float
    lon_rad: float
    alt_m: float
    course: float
    speed_mps: float
    wind_mps: tuple[float, float] = (0.0, 0.0)
    step_hz: int = 120
    ground_m: float = 0.0
    weather: Weather = CALM
    flap_rad: float = 0.0
    burn: bool = False
    grid: float = 0.0
    grid_lon: float = 0.0
    hook_b: tuple[float, float, float] | None = None

    @property
    def local_wind_mps(self) -> tuple[float, float]:
        """The wind to local north and east at the place."""
        north, east = self.wind_mps
        turned = -self.grid * (self.lon_rad - self.grid_lon)
        sin, cos = math.sin(turned), math.cos(turned)
        return north * cos - east * sin, north * sin + east * cos
