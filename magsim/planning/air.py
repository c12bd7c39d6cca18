"""Checks of the wind with the speed and the heights that are flown."""

import math
from collections.abc import Iterator, Sequence

from magsim.scenario import Air, Start
from magsim.scenario.air import wind_at

REACH_M = 200.0
"""Heights this far from the start's count as flown where the wind is compared with the airspeed."""


def check_wind(air: Air, start: Start, also_m: Sequence[float] = ()) -> Iterator[tuple[str, str]]:
    """Yield a problem where the wind is no slower than the airspeed, at the start's height or at others."""
    flown = (start.alt_m, *also_m)
    heights = (*flown, max(0.0, min(flown) - REACH_M), max(flown) + REACH_M)
    steady, height = max((math.hypot(*wind_at(air, start, height)), height) for height in heights)
    at_start = math.hypot(*air.wind_mps)
    gust = air.strongest_gust_mps()
    if at_start >= start.speed_mps:
        what = f"a wind of {at_start:g} m/s"
    elif steady >= start.speed_mps:
        what = f"a wind that shear brings to {steady:.1f} m/s at {height:g} m"
    elif steady + gust >= start.speed_mps:
        what = f"a wind of {steady:.1f} m/s with gusts of {gust:.1f} m/s"
    else:
        return
    key = "wind_north_mps" if abs(air.wind_north_mps) >= abs(air.wind_east_mps) else "wind_east_mps"
    if at_start < start.speed_mps:
        key = "shear" if steady >= start.speed_mps else "gusts" if air.gusts else "random_gusts"
    limit = f"allowed: together less than {start.speed_mps:g}"
    yield key, f"{what} is no slower than the airspeed of {start.speed_mps:g} m/s; {limit}"


def check_still(air: Air, name: str) -> Iterator[tuple[str, str]]:
    """Yield the kinds of moving air that a kinematic carrier cannot have: only steady wind moves it."""
    moving = {
        "turbulence_severity": air.turbulence_severity != 0,
        "turbulence_mps": air.turbulence_mps != 0.0,
        "gusts": bool(air.gusts),
        "random_gusts": air.random_gusts is not None,
    }
    for key, there in moving.items():
        if there:
            text = f"{name} is kinematic, no gust moves it; allowed: steady wind and shear, flight.sway and tow.gusts"
            yield key, text
