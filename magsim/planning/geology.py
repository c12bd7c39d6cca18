"""Geology within the band of compensation, at the speed over ground."""

import math
from collections.abc import Iterator, Sequence

from magsim.planning.air import REACH_M
from magsim.scenario import Air, Crust, Start, Target
from magsim.scenario.air import wind_at
from magsim.signals import BAND_HZ


def slowest_mps(start: Start, air: Air) -> float:
    """Return the slowest speed over ground that airspeed and steady wind make [m/s]."""
    heights = (start.alt_m, max(0.0, start.alt_m - REACH_M), start.alt_m + REACH_M)
    return start.speed_mps - max(math.hypot(*wind_at(air, start, height)) for height in heights)


def shortest_crust_m(crust: Crust, start: Start, air: Air) -> float:
    """Return the shortest wavelength of the crust [m]: as set, or slowest speed over the top of the band."""
    return slowest_mps(start, air) / BAND_HZ[1] if crust.shortest_m is None else crust.shortest_m


def check_crust(crust: Crust, start: Start, air: Air) -> Iterator[tuple[str, str]]:
    """Yield the problems of a crust that does not fill the compensation band."""
    slowest = slowest_mps(start, air)
    most = slowest / BAND_HZ[1]
    if crust.shortest_m is None:
        if most >= crust.longest_m:
            yield "longest_m", f"{crust.longest_m:g} is not above the shortest wavelength, {most:.1f} m"
    elif crust.shortest_m > most * (1.0 + 1e-9) and not crust.allow_smooth:
        text = (
            f"{crust.shortest_m:g} m leaves the top of the compensation band, {BAND_HZ[1]:g} Hz, without geology: the "
            f"slowest speed over ground is {slowest:.4g} m/s; allowed: up to {most:.4g}, or with allow_smooth = true"
        )
        yield "shortest_m", text


def check_targets(targets: Sequence[Target]) -> Iterator[tuple[str, str]]:
    """Yield a problem for each target whose name another target has."""
    names = [target.name for target in targets]
    for i, name in enumerate(names):
        if name in names[:i]:
            yield f"[{i}].name", f"{name!r} is the name of another target, too; allowed: names that differ"
