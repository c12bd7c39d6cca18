"""Columns of the Earth's field along the path: Taylor terms of the position, and the height (paper 002, eq. 11 to 16).

They are signal. A fit holds them beside the columns of the platform, so that what the band-pass lets through of the
geology and of the vertical gradient is not mistaken for interference; nothing of them is ever subtracted.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design, require
from magsim.errors import DataError
from magsim.recording import Recording

MOST_LON_DEG = 90.0
"""Widest range of longitudes of one flight: beyond it a pole is near, where longitude is no coordinate."""

NEAR = 2.0
"""Flights are at one place where their middles are apart by at most this many times the sum of their radii."""


class FlownArea(NamedTuple):
    """Middle of what was flown at one place, and half of its extent: scaled positions run from -1 to 1 there."""

    lat_deg: float
    lon_deg: float
    alt_m: float
    half_lat_deg: float
    half_lon_deg: float
    half_alt_m: float


class PositionColumns(NamedTuple):
    """Columns of the Earth's field for a fit.

    Attributes
    ----------
    designs : list of Design
        One for each recording; the columns of other places are zero in it. Coefficients of ``matrix`` belong to scaled
        positions, ``names`` and ``units`` to physical ones.
    scale : (c,)
        What a coefficient is divided by to be physical: powers of the half extents.
    areas : tuple of FlownArea
    horizontal : (c,) int
        Number of the place that a column of the horizontal field belongs to, from 0; -1 for the height.
    """

    designs: list[Design]
    scale: np.ndarray
    areas: tuple[FlownArea, ...]
    horizontal: np.ndarray


def powers(order: int) -> list[tuple[int, int]]:
    """Return the exponents (n - k, k) of latitude and longitude for n = 1 .. order: 2, 5, 9, 14 pairs."""
    return [(n - k, k) for n in range(1, order + 1) for k in range(n + 1)]


def position_columns(recordings: Sequence[Recording], order: int, *, vertical: bool) -> PositionColumns:
    """Form the columns (lat - lat0)^(n - k) (lon - lon0)^k and height, of scaled positions.

    Position is that of the INS. It is counted from the middle of the flights of one place and divided by half of
    their extent, since raw powers explode. The origin does not matter: it mixes the terms of lower orders, and the
    constant c00 is outside of the band. Flights of one place share one field; another place has columns of its own.

    Parameters
    ----------
    recordings : sequence of Recording
    order : int
        Truncation order N of the horizontal field; 0 reads no position.
    vertical : bool
        Whether the height is a column. With order 0 all recordings share it.

    Raises
    ------
    RequestError
        If a recording lacks a column of the position.
    DataError
        If a position is not finite, or a flight goes over or around a pole.
    """
    exponents = [(*pair, 0) for pair in powers(order)] + [(0, 0, 1)] * vertical
    if not exponents:
        empty = [Design((), (), np.zeros((len(recording), 0))) for recording in recordings]
        return PositionColumns(empty, np.zeros(0), (), np.zeros(0, dtype=int))
    where = [_position(recording, order, vertical=vertical) for recording in recordings]
    groups = _groups(where)
    areas = tuple(_area([where[i] for i in group]) for group in groups)
    names, units, scale = [], [], []
    for number, area in enumerate(areas, start=1):
        mark = f" [{number}]" if len(areas) > 1 else ""
        names += [_name(exponent) + mark for exponent in exponents]
        units += [_unit(exponent) for exponent in exponents]
        scale += [np.prod(np.power(area[3:], exponent)) for exponent in exponents]
    designs: list[Design] = []
    for i, position in enumerate(where):
        number = next(n for n, group in enumerate(groups) if i in group)
        scaled = _scaled(position, areas[number])
        matrix = np.zeros((len(position), len(names)))
        for column, exponent in enumerate(exponents, start=number * len(exponents)):
            matrix[:, column] = np.prod(scaled**exponent, axis=1)
        designs.append(Design(tuple(names), tuple(units), matrix))
    horizontal = [-1 if height else place for place in range(len(areas)) for *_, height in exponents]
    return PositionColumns(designs, np.array(scale), areas, np.array(horizontal))


def _position(recording: Recording, order: int, *, vertical: bool) -> np.ndarray:
    """Return latitude, longitude [deg] and height [m], (n, 3), continuous at the date line; 0 where not asked for."""
    names = [columns.INS_ATTITUDE.name(angle=angle) for angle in ("lat", "lon")] if order else []
    names += [columns.INS_ALTITUDE.pattern] if vertical else []
    require(recording, names)
    for name in names:
        bad = ~np.isfinite(recording[name])
        if bad.any():
            msg = f"recording {recording.name!r}: {name} is not finite at {recording.time_s[np.argmax(bad)]:g} s"
            raise DataError(msg)
    position = np.zeros((len(recording), 3))
    if order:
        position[:, 0] = recording[names[0]]
        lon = np.radians(recording[names[1]])
        middle = np.degrees(np.arctan2(np.sin(lon).mean(), np.cos(lon).mean()))
        position[:, 1] = middle + _wrapped(recording[names[1]] - middle)
        if np.ptp(position[:, 1]) > MOST_LON_DEG:
            msg = (
                f"recording {recording.name!r} covers {np.ptp(position[:, 1]):.0f} degrees of longitude, so a pole is "
                f"near; gradient terms of order 1 and more need less than {MOST_LON_DEG:g}"
            )
            raise DataError(msg)
    if vertical:
        position[:, 2] = recording[names[-1]]
    return position


def _wrapped(difference_deg: np.ndarray) -> np.ndarray:
    """Return differences of longitudes the short way round, in [-180, 180) degrees."""
    return (difference_deg + 180.0) % 360.0 - 180.0


def _groups(where: Sequence[np.ndarray]) -> list[list[int]]:
    """Return the numbers of the flights of each place: those near each other, directly or through others."""
    middles = np.array([(p.min(axis=0) + p.max(axis=0)) / 2.0 for p in where])
    halves = np.array([np.ptp(p, axis=0) / 2.0 for p in where])
    shrink = np.cos(np.radians(middles[:, 0]))
    radii = np.hypot(halves[:, 0], halves[:, 1] * shrink)
    groups: list[list[int]] = []
    for i in range(len(where)):
        north = middles[:, 0] - middles[i, 0]
        east = _wrapped(middles[:, 1] - middles[i, 1]) * shrink[i]
        near = np.hypot(north, east) <= NEAR * (radii + radii[i])
        touched = [group for group in groups if near[group].any()]
        groups = [group for group in groups if group not in touched]
        groups.append(sorted([i, *(j for group in touched for j in group)]))
    return sorted(groups)


def _area(where: Sequence[np.ndarray]) -> FlownArea:
    """Return middle and half extent of flights; an extent of zero counts as one unit."""
    beside = np.concatenate([_beside(position, where[0][0, 1]) for position in where])
    low, high = beside.min(axis=0), beside.max(axis=0)
    half = np.where(high > low, (high - low) / 2.0, 1.0)
    middle = (low + high) / 2.0
    middle[1] = _wrapped(middle[1])
    return FlownArea(*middle.tolist(), *half.tolist())


def _beside(position: np.ndarray, lon_deg: float) -> np.ndarray:
    """Return positions whose longitudes are shifted next to a given one by whole turns."""
    turns = np.round((position[0, 1] - lon_deg) / 360.0)
    return position - np.array([0.0, 360.0 * turns, 0.0])


def _scaled(position: np.ndarray, area: FlownArea) -> np.ndarray:
    """Return positions in an area, (n, 3), from -1 to 1 on what was flown there."""
    return (_beside(position, area.lon_deg) - area[:3]) / area[3:]


def _name(exponent: tuple[int, int, int]) -> str:
    words = zip(("lat", "lon", "height"), exponent, strict=True)
    return " ".join(word if power == 1 else f"{word}^{power}" for word, power in words if power)


def _unit(exponent: tuple[int, int, int]) -> str:
    if exponent[2]:
        return "nT/m"
    order = exponent[0] + exponent[1]
    return "nT/deg" + (f"^{order}" if order > 1 else "")
