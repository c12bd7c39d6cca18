"""What is hardly meant in a recording from elsewhere: dead channels, units, heights in feet, another north."""

import math
from collections.abc import Iterator
from datetime import datetime

import numpy as np

from magsim import columns
from magsim.earth import decimal_year, igrf, radii_of_curvature, utm_zone
from magsim.recording.channels import FEWEST, problems_of
from magsim.recording.recording import Recording
from magsim.signals import spans

FOOT_M = 0.3048

NEAR_FOOT = 0.05
"""How far a ratio of heights may be off that of feet and meters: geoid and weather make 100 m of 2000."""

LEAST_HEIGHT_M = 150.0
"""Below it, geoid and weather are as large as a height in the wrong unit."""

LEAST_SPEED_MPS = 8.0
"""Slowest motion that has a course."""

MOST_OFF_DEG = 1.5
"""Largest mean of heading minus course that is taken for a mount. Estimate: mounts are leveled to some tenths of a
degree; wind cancels to the second order."""

SIDES = 3
"""On so many of the four sides of the compass a flight must have been: then wind and north can be told apart."""


def doubts_of(recording: Recording) -> tuple[str, ...]:
    """Return what is hardly meant in a recording from elsewhere, one line each, with what would mend it.

    Parameters
    ----------
    recording : Recording
        What its columns do not tell is not judged.
    """
    return (*problems_of(recording.data), *_heights(recording), *_north(recording))


def _heights(recording: Recording) -> Iterator[str]:
    ins, baro = columns.INS_ALTITUDE.pattern, columns.BARO_ALTITUDE.pattern
    if not (ins in recording and baro in recording):
        return
    middle = {name: float(np.median(recording[name])) for name in (ins, baro)}
    low, high = sorted(middle, key=lambda name: middle[name])
    if middle[low] >= LEAST_HEIGHT_M and abs(middle[high] / middle[low] * FOOT_M - 1.0) <= NEAR_FOOT:
        yield (
            f"{high} is {middle[high]:.0f} in the middle and {low} {middle[low]:.0f}: is the first in feet? A map file "
            f"gives columns their scale: {FOOT_M}"
        )


def _north(recording: Recording) -> Iterator[str]:
    """Heading minus course, without what wind from one side makes of it, is what the INS is turned by."""
    name = columns.INS_ATTITUDE.name(angle="heading")
    place = [columns.INS_ATTITUDE.name(angle=angle) for angle in ("lat", "lon")]
    if any(column not in recording for column in (name, *place)):
        return
    course, moving = _course(recording)
    sides = np.unique(np.round(np.degrees(course[moving]) / 90.0) % 4)
    if moving.sum() < FEWEST or len(sides) < SIDES:
        return
    off = np.radians(recording[name]) - course
    off = np.degrees((off + np.pi) % (2.0 * np.pi) - np.pi)[moving]
    wind = np.column_stack([np.ones(len(off)), np.sin(course[moving]), np.cos(course[moving])])
    mean = float(np.linalg.lstsq(wind, off, rcond=None)[0][0])
    if abs(mean) > MOST_OFF_DEG:
        yield (
            f"{name} is {mean:+.1f} deg off the course, on all sides of the compass, so no wind: "
            f"{_told(recording, mean)} A map file gives columns their offset: {-mean:.1f}"
        )


def _course(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction of motion, (n,) [rad], and the rows that have one."""
    lat, lon = (np.radians(recording[columns.INS_ATTITUDE.name(angle=angle)]) for angle in ("lat", "lon"))
    meridian, normal = radii_of_curvature(lat)
    north, east = np.zeros(len(lat)), np.zeros(len(lat))
    for span in spans(recording.time_s):
        if span.stop - span.start >= 2:
            time_s = recording.time_s[span]
            north[span] = meridian[span] * np.gradient(lat[span], time_s)
            east[span] = normal[span] * np.cos(lat[span]) * np.gradient(np.unwrap(lon[span]), time_s)
    return np.arctan2(east, north), np.hypot(north, east) >= LEAST_SPEED_MPS


def _told(recording: Recording, off_deg: float) -> str:
    """Return what another north would make of the heading there, in words."""
    lat, lon = (float(np.median(recording[columns.INS_ATTITUDE.name(angle=angle)])) for angle in ("lat", "lon"))
    zone = utm_zone(lat, lon)
    away = math.radians(lon - (6.0 * zone - 183.0))
    grid = -math.degrees(math.atan(math.tan(away) * math.sin(math.radians(lat))))
    found = {"grid north": grid}
    start = recording.meta.get("start_utc")
    if isinstance(start, str):
        field = igrf(math.radians(lat), math.radians(lon), 0.0, decimal_year(datetime.fromisoformat(start)))
        found["magnetic north"] = -math.degrees(math.atan2(field[1], field[0]))
    nearest = min(found, key=lambda word: abs(found[word] - off_deg))
    words = " and ".join(f"{word} {value:+.1f}" for word, value in found.items())
    guess = (
        f"does it count from {nearest}" if abs(found[nearest] - off_deg) <= 1.0 else "is the INS turned in its mount"
    )
    return f"{guess} ({words} there)?"
