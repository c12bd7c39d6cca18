"""What each set of a ladder draws: site, individual, day, courses, air, bodies in the ground, errors of instruments.

A set is a function of the ladder's seed and its number alone. Seeds of noise by themselves would be no replication:
they move the scores of Tolles-Lawson by less than a percent, other courses by a third.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from magsim.config import toml
from magsim.earth import decimal_year, igrf
from magsim.streams import integer_seed, stream

INCLINATIONS_DEG = ((20.0, 35.0), (35.0, 50.0), (50.0, 65.0), (65.0, 80.0))
"""Classes of sites; sets take them in turn, on either side of the magnetic equator."""

FIRST_DAY, DAYS = datetime(2020, 1, 1, tzinfo=UTC), 3650
"""Dates, within the years of IGRF-14."""

LINE_M = 22_000.0
EARTH_M = 6_371_000.0

TAG_S = 0.05
"""How early other instruments are by the clock of a counter that tags the end of its window of 0.1 s [s]."""


@dataclass(frozen=True)
class Site:
    """A place on the ground [deg]."""

    lat_deg: float
    lon_deg: float


@dataclass(frozen=True)
class SetDraw:
    """What one set has drawn.

    Attributes
    ----------
    number : int
    site, elsewhere, near : Site
        Where it is flown; a place in another class of inclination; one 300 km away.
    individual, other : int
        Aircraft of the type.
    day : int
    half_widths_nt : (3,) [nT]
        Of the steel's hysteresis, on levels that draw it.
    words : mapping
        Values by the words that the ladder's file has in braces, as TOML.
    """

    number: int
    site: Site
    elsewhere: Site
    near: Site
    individual: int
    other: int
    day: int
    half_widths_nt: tuple[float, ...]
    words: Mapping[str, str]


def draw_set(seed: int, number: int) -> SetDraw:
    """Draw a set.

    Parameters
    ----------
    seed : int
        Of the ladder: public, or hidden until its scores are published.
    number : int
        Of the set, from 0.
    """
    rng = stream(seed, f"ladder/set/{number}")
    began = FIRST_DAY + timedelta(days=int(rng.integers(DAYS)), hours=float(rng.uniform(0.0, 20.0)))
    site = _site(rng, number % 4, began)
    elsewhere = _site(rng, (number + 1 + int(rng.integers(3))) % 4, began)
    individual, other = (int(value) for value in rng.choice(999_999, 2, replace=False) + 1)
    day = int(rng.integers(1, 51))
    widths = np.sort(np.exp(rng.uniform(np.log(500.0), np.log(20_000.0), 3)))
    words = {**_flown(rng, began), **_errors(rng), "crust_seed": integer_seed(seed, f"ladder/crust/{number}")}
    texts = {name: toml.text_of(value) for name, value in words.items()}
    return SetDraw(
        number, site, elsewhere, _moved(rng, site, 300_000.0), individual, other, day, tuple(map(float, widths)), texts
    )


def _site(rng: np.random.Generator, number: int, when: datetime) -> Site:
    """Return a place whose inclination is of a class, evenly over the globe up to 70 degrees of latitude."""
    low, high = INCLINATIONS_DEG[number]
    while True:
        lat, lon = np.arcsin(rng.uniform(*np.sin(np.radians([-70.0, 70.0])))), rng.uniform(-np.pi, np.pi)
        field = igrf(lat, lon, 3000.0, decimal_year(when))
        if low <= abs(np.degrees(np.arctan2(field[2], np.hypot(field[0], field[1])))) < high:
            return Site(round(float(np.degrees(lat)), 4), round(float(np.degrees(lon)), 4))


def _moved(rng: np.random.Generator, site: Site, distance_m: float) -> Site:
    """Return the place in a drawn direction on the sphere."""
    bearing, arc, lat = rng.uniform(0.0, 2.0 * np.pi), distance_m / EARTH_M, np.radians(site.lat_deg)
    there = np.arcsin(np.sin(lat) * np.cos(arc) + np.cos(lat) * np.sin(arc) * np.cos(bearing))
    turn = np.arctan2(np.sin(bearing) * np.sin(arc) * np.cos(lat), np.cos(arc) - np.sin(lat) * np.sin(there))
    lon = (site.lon_deg + np.degrees(turn) + 180.0) % 360.0 - 180.0
    return Site(round(float(np.degrees(there)), 4), round(float(lon), 4))


def _flown(rng: np.random.Generator, began: datetime) -> dict[str, object]:
    """Return courses, air, times and bodies in the ground."""
    course = float(rng.uniform(0.0, 360.0))
    courses = {
        "train_1": course,
        "train_2": course + float(rng.uniform(20.0, 70.0)),
        "circuit": course + float(rng.uniform(20.0, 70.0)) + 90.0 * float(rng.integers(4)),
        "line": float(rng.uniform(0.0, 360.0)),
        "targets": float(rng.uniform(0.0, 360.0)),
        "rough": float(rng.uniform(0.0, 360.0)),
    }
    out: dict[str, object] = {}
    for number, (role, value) in enumerate(courses.items()):
        # a whole tenth below 360, whatever is rounded
        out[f"heading_{role}"] = round(value % 360.0, 1) % 360.0
        out[f"time_{role}"] = (began + timedelta(minutes=40 * number)).replace(microsecond=0)
        rough = role == "rough"
        out[f"air_{role}"] = round(float(rng.uniform(1.4, 1.9) if rough else rng.uniform(0.3, 1.0)), 2)
    along = np.arange(3_000.0, LINE_M - 1_000.0, 2_500.0)
    out["bodies"] = _bodies(rng, along + rng.uniform(-800.0, 800.0, len(along)), courses["targets"])
    out["calibration_bodies"] = _bodies(rng, np.linspace(1_500.0, 8_000.0, 4), courses["train_1"])
    return out


def _bodies(rng: np.random.Generator, along_m: np.ndarray, course_deg: float) -> list[dict[str, object]]:
    """Return buried dipoles near a line from the start: 1 to 50 nT at 150 m above them."""
    course, out = np.radians(course_deg), []
    for number, along in enumerate(along_m):
        across, depth = rng.uniform(-80.0, 80.0), rng.uniform(2.0, 40.0)
        peak_nt = np.exp(rng.uniform(np.log(1.0), np.log(50.0)))
        direction = rng.standard_normal(3)
        # 2e-7 m / r^3 on the axis of a dipole
        moment = peak_nt * 1e-9 * (150.0 + depth) ** 3 / 2e-7 * direction / np.linalg.norm(direction)
        out.append(
            {
                "name": f"body_{number}",
                "kind": "dipole",
                "north_m": round(float(along * np.cos(course) - across * np.sin(course)), 1),
                "east_m": round(float(along * np.sin(course) + across * np.cos(course)), 1),
                "depth_m": round(float(depth), 1),
                "moment_am2": [round(float(value), 1) for value in moment],
            }
        )
    return out


def _errors(rng: np.random.Generator) -> dict[str, object]:
    """Return errors of fluxgate, INS and clocks, of the sizes that docs/instruments.md gives sources for."""

    def signed(low: float, high: float, digits: int) -> list[float]:
        return [round(float(value), digits) for value in rng.uniform(low, high, 3) * rng.choice([-1.0, 1.0], 3)]

    late = round(float(rng.uniform(0.03, 0.2)), 3)
    ins_late = round(float(rng.uniform(0.02, 0.05) * rng.choice([-1.0, 1.0])), 3)
    return {
        "flux_offset": signed(10.0, 60.0, 1),
        "flux_scale": signed(0.002, 0.01, 5),
        "flux_angles": signed(0.1, 0.6, 3),
        "flux_mounting": signed(0.1, 0.8, 3),
        "flux_late": late,
        "flux_late_by_tag": round(late - TAG_S, 3),
        "flux_pole": round(float(rng.uniform(1.0, 5.0)), 2),
        "ins_late_by_tag": round(ins_late - TAG_S, 3),
        "flux_offset_drift": signed(0.1, 0.6, 2),
        "flux_scale_drift": signed(20.0, 100.0, 1),
        "cabin_start": round(float(rng.uniform(-5.0, 10.0)), 1),
        "cabin_settled": round(float(rng.uniform(15.0, 25.0)), 1),
        "flexure": signed(0.1, 0.4, 2),
    }
