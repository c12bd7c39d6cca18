"""Swell where it can be felt: over the sea, and not too high above it."""

import math
from collections.abc import Iterator

import numpy as np

from magsim.aircraft import Bird
from magsim.earth import decimal_year, igrf
from magsim.earth.sea import swell_rms_nt
from magsim.errors import DataError
from magsim.planning.patterns import heights_of
from magsim.scenario import Scenario, SurveyPattern, Swell, TrackLog, TrackPattern, parts_of
from magsim.terrain import Ground, TangentPlane

LEAST_NT = 1e-6
"""A swell that leaves less at the lowest height that is planned is refused: it would be a setting without effect."""


def check_swell(
    scenario: Scenario, ground: Ground | None, track: TrackLog | None, bird: Bird | None
) -> Iterator[tuple[str, str]]:
    """Yield the problem of a swell on land or too far below the flight, as far as plan and ground tell it: key, text.

    Parameters
    ----------
    scenario : Scenario
    ground : Ground, optional
        Without it, the ellipsoid is the sea.
    track : TrackLog, optional
        That is flown; of a pattern, its start; ``magsim.flight.check_over_sea`` checks its path.
    bird : Bird, optional
        That is towed below.
    """
    settings = scenario.field.swell
    if settings is None or not settings.enabled:
        return
    land_m = land_below_m(scenario, ground, track)
    if land_m is not None:
        where = "on the track" if track is not None else "at the start"
        text = (
            f"waves need the sea, and the ground {where} is {land_m:g} m high; allowed: over the sea, where [terrain] "
            "is 0 m high or left out"
        )
        yield "field.swell", text
        return
    lowest_m, most_m = lowest_above_sea_m(scenario, ground, track, bird), highest_felt_m(scenario, settings)
    if lowest_m > most_m:
        text = (
            f"{lowest_m:.0f} m above the sea, the lowest height of the plan, it leaves less than {LEAST_NT:g} nT; "
            f"allowed: up to {math.floor(most_m)} m, a longer period_s, or no [field.swell]"
        )
        yield "field.swell", text


def land_below_m(scenario: Scenario, ground: Ground | None, track: TrackLog | None) -> float | None:
    """Return the first height [m] of ground that is known to lie below the flight and is not the sea, or None."""
    if ground is None:
        return None
    start = scenario.start
    lat, lon = np.radians([start.lat_deg]), np.radians([start.lon_deg])
    if track is not None and "lat" in track:
        lat, lon = track["lat"], track["lon"]
    elif track is not None:
        lat, lon = TangentPlane(float(lat[0]), float(lon[0]), start.alt_m).geodetic(track["north"], track["east"])
    try:
        heights = ground.surface.height(lat, lon)
    except DataError:  # outside of a grid: the flight reports it with the time
        return None
    land = heights != 0.0 if ground.level else heights > 0.0  # a grid may have the bottom of the sea
    return float(heights[land.argmax()]) if land.any() else None


def lowest_above_sea_m(scenario: Scenario, ground: Ground | None, track: TrackLog | None, bird: Bird | None) -> float:
    """Return the lowest planned height above the sea [m]; a bird may hang as low as its rope lets it."""
    geoid_m = 0.0 if ground is None else ground.geoid_m
    pattern = scenario.pattern
    if isinstance(pattern, TrackPattern):
        assert track is not None
        lowest = float(track["alt"].min()) - (geoid_m if pattern.heights == "ellipsoid" else 0.0)
    else:
        drapes = [p.drape_m for p in parts_of(pattern) if isinstance(p, SurveyPattern) and p.drape_m is not None]
        lowest = min(*(height - geoid_m for height in heights_of(pattern, scenario.start)), math.inf, *drapes)
    if scenario.tow is None or bird is None:
        return lowest
    return lowest - (scenario.tow.rope.length_m or bird.facts.rope.length.value)


def highest_felt_m(scenario: Scenario, settings: Swell) -> float:
    """Return the height above the sea [m] at which ``LEAST_NT`` is left of a swell; 0 if it is nowhere so strong."""
    start = scenario.start
    place = math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m
    main_nt = float(np.linalg.norm(igrf(*place, decimal_year(start.time_utc))))

    def missing(above_m: float) -> float:
        left = swell_rms_nt(
            above_m,
            height_m=settings.height_m,
            period_s=settings.period_s,
            gamma=settings.peak,
            conductivity_spm=settings.conductivity_spm,
            main_nt=main_nt,
        )
        return left - LEAST_NT

    low, high = 0.0, 100_000.0
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if missing(middle) > 0.0 else (low, middle)
    return low
