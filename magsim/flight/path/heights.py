"""The height plan of a flight that is not level: draped over the ground, or with parts at heights of their own.

The plan of a drape is above the ground by a clearance, no steeper than a slope, and smooth. It is made in three steps
along the path. The lowest profile that clears the ground and nowhere exceeds the slope is the envelope of the ramps
through every point. A running mean with a raised-cosine window rounds its corners, so that the vertical
acceleration stays small; a mean of a profile is never steeper than the profile. The height that the rounding removes
from the crests is added everywhere. Level parts of a sequence take part with their height, held from some seconds
before their first leg to their end. The ramps between them are in the transits: up as late, down as early as possible.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from magsim.errors import RequestError
from magsim.flight.path.elements import Element
from magsim.flight.path.plane import LocalPlane
from magsim.scenario import LegPattern, SurveyPattern
from magsim.terrain import Ground, TangentPlane
from magsim.units import G0

STEP_M = 10.0
"""Spacing of the plan along the path."""


VERTICAL_G = 0.1
"""Largest vertical acceleration of the plan, in g."""


SETTLE_S = 15.0
"""A level part's height is reached this long before its first leg."""


HIGH_M = 5.0
"""A draped part may be planned so much above its own plan because of a transit's rounding."""


@dataclass(frozen=True)
class HeightPlan:
    """Heights along a path.

    Attributes
    ----------
    first_m : float
        Distance along the path of the first height; negative before the path's beginning.
    height_m : (n,)
        Planned heights above the ellipsoid, ``STEP_M`` apart.
    ground_m : (n,)
        The ground below.
    rounding_m : float
        Height that was added everywhere for the rounding of crests.
    """

    first_m: float
    height_m: np.ndarray
    ground_m: np.ndarray
    rounding_m: float

    @cached_property
    def _heights(self) -> list[float]:
        return self.height_m.tolist()  # plain numbers: they are read forty times a second

    def at(self, along_m: float) -> float:
        """Return the planned height [m] at a distance along the path; level beyond the ends."""
        heights = self._heights
        place = min(max((along_m - self.first_m) / STEP_M, 0.0), len(heights) - 1.0)
        index = min(int(place), len(heights) - 2)
        low, high = heights[index], heights[index + 1]
        return low + (place - index) * (high - low)

    def slope(self, along_m: float) -> float:
        """Return the planned climb for each meter along the path."""
        return (self.at(along_m + STEP_M) - self.at(along_m - STEP_M)) / (2.0 * STEP_M)


def ramps(target_m: np.ndarray, slope: np.ndarray | float, step_m: float) -> np.ndarray:
    """Return the lowest profile that is nowhere below a target and nowhere steeper than a slope.

    Parameters
    ----------
    target_m : (n,)
        Minus infinity where there is no target.
    slope : float or (n,)
        At each point, or everywhere.
    step_m : float
        Distance of the points.

    Returns
    -------
    (n,)
        At each point the highest ramp that falls from any point to either side.
    """
    steep = np.broadcast_to(np.asarray(slope, dtype=float), target_m.shape)
    # Between two points the gentler of their slopes holds.
    fall = np.concatenate([[0.0], np.cumsum(np.minimum(steep[1:], steep[:-1]) * step_m)])
    forward = np.maximum.accumulate(target_m + fall) - fall
    backward = (np.maximum.accumulate((target_m - fall)[::-1]))[::-1] + fall
    return np.maximum(forward, backward)


def rounded(profile_m: np.ndarray, window_m: float, step_m: float) -> np.ndarray:
    """Smooth by a running mean with a raised-cosine window; the ends are continued level."""
    half = max(1, round(0.5 * window_m / step_m))
    weights = 1.0 + np.cos(np.pi * np.arange(-half, half + 1) / (half + 1))
    padded = np.pad(profile_m, half, mode="edge")
    out = np.zeros(len(profile_m))
    for shift, weight in enumerate(weights / weights.sum()):
        out += weight * padded[shift : shift + len(profile_m)]
    return out


def window_of(slope: float, speed_mps: float) -> float:
    """Return the window [m] that keeps the vertical acceleration of a crest between two full ramps at ``VERTICAL_G``.

    The rounded crest bends by twice the slope times the window's peak, which is 2 / window.
    """
    return 4.0 * slope * speed_mps**2 / (VERTICAL_G * G0)


def plan_heights(
    target_m: np.ndarray, slope: np.ndarray | float, window_m: float, step_m: float
) -> tuple[np.ndarray, float]:
    """Return smooth heights that are nowhere below a target, and the height [m] that was added for the rounding."""
    smooth = rounded(ramps(target_m, slope, step_m), window_m, step_m)
    lift = max(0.0, float(np.max(target_m - smooth)))
    return smooth + lift, lift


def plan_path(
    path: Sequence[Element],
    parts: Sequence[LegPattern],
    plane: LocalPlane,
    ground: Ground | None,
    *,
    alt_m: float,
    climb_mps: float,
    speed_mps: float,
    before_m: float,
    after_m: float,
    ceiling_m: float,
) -> HeightPlan | None:
    """Plan the heights of a path: level parts at theirs, draped ones over the ground, climbs in the transits.

    Parameters
    ----------
    path : sequence of Element
    parts : sequence of LegPattern
        The patterns of the flight, in order.
    plane : LocalPlane
        In which the path lies.
    ground : Ground, optional
        Needed where a part is draped.
    alt_m : float
        Height of parts that set none.
    climb_mps : float
        Largest climb and descent in the transits.
    speed_mps : float
        Largest speed over ground.
    before_m, after_m : float
        Straight flight before the path and behind it.
    ceiling_m : float
        Of the aircraft.

    Returns
    -------
    HeightPlan or None
        None where the whole flight is level.

    Raises
    ------
    RequestError
        If the plan is above the aircraft's ceiling, or a transit is too short for its climb.
    DataError
        If the path leaves the terrain grid.
    """
    heights_of = [part.height_m(alt_m) for part in parts]
    if all(height == alt_m for height in heights_of):
        return None
    total = math.fsum(element.length_m for element in path)
    along = np.arange(-before_m, total + after_m + STEP_M, STEP_M)
    places, element = _places(path, along)
    part_of = np.array([e.label.part for e in path])[element]
    transit = np.array([e.label.transit for e in path])[element]
    below = np.zeros(len(along))
    if ground is not None:
        lat, lon = TangentPlane(plane.lat_rad, plane.lon_rad, plane.alt_m).geodetic(places[:, 0], places[:, 1])
        below = ground.height(lat, lon)
    drapes = {
        number: (part.drape_m, part.climb_slope)
        for number, part in enumerate(parts)
        if isinstance(part, SurveyPattern) and part.drape_m is not None
    }
    slope = np.full(len(along), climb_mps / speed_mps)
    for number, (_, climb_slope) in drapes.items():
        slope[(part_of == number) & ~transit] = climb_slope
    window_m = window_of(float(slope.max()), speed_mps)
    target, rounding_m, planned = np.full(len(along), -np.inf), 0.0, []
    for number, height_m in enumerate(heights_of):
        rows = np.flatnonzero((part_of == number) & ~transit)
        if number in drapes:
            clearance_m, _ = drapes[number]
            # The transits on both sides keep clear of the ground too.
            around = transit & ((part_of == number) | (part_of == number - 1))
            around[rows] = True
            own, lift = plan_heights(np.where(around, below + clearance_m, -np.inf), slope, window_m, STEP_M)
            target[around] = np.maximum(target[around], below[around] + clearance_m + lift)
            rounding_m = max(rounding_m, lift)
        else:
            own = np.full(len(along), height_m)
            held = _held(rows, transit, speed_mps, window_m)
            target[held] = np.maximum(target[held], own[held])
        planned.append(_PartHeights(rows, own, number in drapes))
    for number in range(1, len(parts)):
        between = transit & (part_of == number - 1)
        target[between] = np.maximum(target[between], min(planned[number - 1].last_m, planned[number].first_m))
    _check_transits(path, planned, slope=climb_mps / speed_mps, window_m=window_m, settle_m=SETTLE_S * speed_mps)
    heights = rounded(ramps(target, slope, STEP_M), window_m, STEP_M)
    if drapes:
        _check_ceiling(float(heights.max()), max(clearance_m for clearance_m, _ in drapes.values()), ceiling_m)
    _check_parts(heights, planned)
    return HeightPlan(-before_m, heights, below, rounding_m)


class _PartHeights(NamedTuple):
    """Heights of one part of a flight: its rows along the path, and its own plan at all rows."""

    rows: np.ndarray
    own_m: np.ndarray
    draped: bool

    @property
    def first_m(self) -> float:
        return float(self.own_m[self.rows[0]])

    @property
    def last_m(self) -> float:
        return float(self.own_m[self.rows[-1]])


def _places(path: Sequence[Element], along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return north and east (n, 2) at distances along a path, and the element of each."""
    places, elements = np.empty((len(along), 2)), np.empty(len(along), dtype=int)
    index, done = 0, 0.0
    for row, distance in enumerate(along.tolist()):
        while distance - done > path[index].length_m and index + 1 < len(path):
            done += path[index].length_m
            index += 1
        places[row] = path[index].at(distance - done)[:2]
        elements[row] = index
    return places, elements


def _held(rows: np.ndarray, transit: np.ndarray, speed_mps: float, window_m: float) -> np.ndarray:
    """Return the rows at which a level part's height is held: its own, settling, and room for the rounding."""
    half = math.ceil(0.5 * window_m / STEP_M) + 1
    first = max(0, rows[0] - half - math.ceil(SETTLE_S * speed_mps / STEP_M))
    held = np.arange(first, min(len(transit), rows[-1] + half + 1))
    inside = (held >= rows[0]) & (held <= rows[-1])
    return held[inside | transit[held]]


def _check_transits(
    path: Sequence[Element], planned: Sequence[_PartHeights], *, slope: float, window_m: float, settle_m: float
) -> None:
    """Check that each transit is long enough for its climb."""
    for number in range(1, len(planned)):
        before, after = planned[number - 1].last_m, planned[number].first_m
        if before == after:
            continue
        length = math.fsum(e.length_m for e in path if e.label.transit and e.label.part == number - 1)
        room = window_m + 4.0 * STEP_M + (0.0 if planned[number].draped else settle_m)
        needed = abs(after - before) / slope + room
        if length < needed:
            reach = max(0.0, length - room) * slope
            what = "climb" if after > before else "descent"
            msg = (
                f"pattern.parts[{number}]: the transit before it is {length:.0f} m long, but the {what} from "
                f"{before:.0f} to {after:.0f} m within the aircraft's climb limit needs {needed:.0f} m; allowed: that "
                f"much (by north_m and east_m), or a difference of up to {reach:.0f} m"
            )
            raise RequestError(msg)


def _check_ceiling(highest_m: float, clearance_m: float, ceiling_m: float) -> None:
    """Check that a draped flight stays below the aircraft's ceiling."""
    if highest_m > ceiling_m:
        msg = (
            f"pattern.drape_m: {clearance_m:g} m above this ground reaches {highest_m:.0f} m above the ellipsoid; "
            f"allowed: up to the ceiling of the aircraft, {ceiling_m:g} m"
        )
        raise RequestError(msg)


def _check_parts(heights: np.ndarray, planned: Sequence[_PartHeights]) -> None:
    """Check that each part is planned at its own heights in spite of its neighbors and the ground between."""
    for number, part in enumerate(planned):
        off = float(np.abs(heights[part.rows] - part.own_m[part.rows]).max())
        if off > (HIGH_M if part.draped else 0.1):
            msg = (
                f"pattern.parts[{number}]: the transits beside it, which must clear the ground by the next drape_m, "
                f"lead {off:.0f} m off its heights; allowed: a higher alt_m of the level part, or longer transits"
            )
            raise RequestError(msg)
