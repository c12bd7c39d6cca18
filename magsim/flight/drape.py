"""The height plan of a draped flight: above the ground by a clearance, no steeper than a slope, and smooth.

The plan is made in three steps along the path. The lowest profile that clears the ground and nowhere exceeds the slope
is the envelope of ramps that rise and fall from every point. A running mean with a raised-cosine window rounds its
corners, so that the vertical acceleration stays small; a mean of a profile is never steeper than the profile. What the
rounding has taken off the crests is added everywhere.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from magsim.errors import DataError, RequestError
from magsim.flight.elements import Element
from magsim.flight.patterns import LocalPlane
from magsim.terrain import Ground, TangentPlane
from magsim.trajectory import Segment, Trajectory
from magsim.units import G0

STEP_M = 10.0
"""Spacing of the plan along the path."""

VERTICAL_G = 0.1
"""Largest vertical acceleration of the plan, in g."""

OFF_PLAN_M = 80.0
"""A draped line that is flown farther from its plan was not held."""


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
        What the rounding of crests has added everywhere.
    """

    first_m: float
    height_m: np.ndarray
    ground_m: np.ndarray
    rounding_m: float

    @cached_property
    def _heights(self) -> list[float]:
        return self.height_m.tolist()  # plain numbers: they are asked for forty times a second

    def at(self, along_m: float) -> float:
        """Planned height [m] at a distance along the path; level beyond the ends."""
        heights = self._heights
        place = min(max((along_m - self.first_m) / STEP_M, 0.0), len(heights) - 1.0)
        index = min(int(place), len(heights) - 2)
        low, high = heights[index], heights[index + 1]
        return low + (place - index) * (high - low)

    def slope(self, along_m: float) -> float:
        """Planned climb for each meter along the path."""
        return (self.at(along_m + STEP_M) - self.at(along_m - STEP_M)) / (2.0 * STEP_M)


def ramps(target_m: np.ndarray, slope: float, step_m: float) -> np.ndarray:
    """The lowest profile that is nowhere below a target and nowhere steeper than a slope.

    Parameters
    ----------
    target_m : (n,)
    slope : float
    step_m : float
        Distance of the points.

    Returns
    -------
    (n,)
        At each point the highest ramp that falls from any point to either side.
    """
    fall = slope * step_m * np.arange(len(target_m))
    forward = np.maximum.accumulate(target_m + fall) - fall
    backward = (np.maximum.accumulate((target_m - fall)[::-1]) + fall[::-1])[::-1]
    return np.maximum(forward, backward)


def rounded(profile_m: np.ndarray, window_m: float, step_m: float) -> np.ndarray:
    """Running mean with a raised-cosine window; the ends are continued level."""
    half = max(1, round(0.5 * window_m / step_m))
    weights = 1.0 + np.cos(np.pi * np.arange(-half, half + 1) / (half + 1))
    padded = np.pad(profile_m, half, mode="edge")
    out = np.zeros(len(profile_m))
    for shift, weight in enumerate(weights / weights.sum()):
        out += weight * padded[shift : shift + len(profile_m)]
    return out


def window_of(slope: float, speed_mps: float) -> float:
    """Window [m] that keeps the vertical acceleration of a crest between two full ramps at ``VERTICAL_G``.

    The rounded crest bends by twice the slope times the window's peak, which is 2 / window.
    """
    return 4.0 * slope * speed_mps**2 / (VERTICAL_G * G0)


def plan_heights(target_m: np.ndarray, slope: float, speed_mps: float, step_m: float) -> tuple[np.ndarray, float]:
    """Smooth heights that are nowhere below a target, and what the rounding has added to them [m]."""
    smooth = rounded(ramps(target_m, slope, step_m), window_of(slope, speed_mps), step_m)
    lift = max(0.0, float(np.max(target_m - smooth)))
    return smooth + lift, lift


def plan_drape(
    path: Sequence[Element],
    plane: LocalPlane,
    ground: Ground,
    *,
    drape_m: float,
    slope: float,
    speed_mps: float,
    before_m: float,
    after_m: float,
    ceiling_m: float,
) -> HeightPlan:
    """Plan the heights of a path over the ground.

    Parameters
    ----------
    path : sequence of Element
    plane : LocalPlane
        In which it lies.
    ground : Ground
    drape_m : float
        Least height above ground.
    slope : float
        Steepest climb and descent, height over distance.
    speed_mps : float
        Largest speed over ground.
    before_m, after_m : float
        Straight flight before the path and behind it.
    ceiling_m : float
        Of the aircraft.

    Raises
    ------
    RequestError
        If the plan is above the aircraft's ceiling.
    DataError
        If the path leaves the terrain grid.
    """
    total = math.fsum(element.length_m for element in path)
    along = np.arange(-before_m, total + after_m + STEP_M, STEP_M)
    places = np.empty((len(along), 2))
    index, done = 0, 0.0
    for row, distance in enumerate(along.tolist()):
        while distance - done > path[index].length_m and index + 1 < len(path):
            done += path[index].length_m
            index += 1
        places[row] = path[index].at(distance - done)[:2]
    lat, lon = TangentPlane(plane.lat_rad, plane.lon_rad, plane.alt_m).geodetic(places[:, 0], places[:, 1])
    below = ground.height(lat, lon)
    heights, lift = plan_heights(below + drape_m, slope, speed_mps, STEP_M)
    highest = float(heights.max())
    if highest > ceiling_m:
        msg = (
            f"pattern.drape_m: {drape_m:g} m above this ground reaches {highest:.0f} m above the ellipsoid; allowed: "
            f"up to the ceiling of the aircraft, {ceiling_m:g} m"
        )
        raise RequestError(msg)
    return HeightPlan(-before_m, heights, below, lift)


def drape_notes(
    planned: Sequence[tuple[float, float]],
    zero_s: float,
    segments: Sequence[Segment],
    carrier: Trajectory,
    ground: Ground | None,
) -> dict[str, object]:
    """How well the planned heights were flown on the lines, and what was left above the ground.

    Parameters
    ----------
    planned : sequence of (float, float)
        Time on the plant's clock [s] and planned height [m].
    zero_s : float
        Row 0 on that clock.
    segments : sequence of Segment
    carrier : Trajectory
    ground : Ground, optional

    Raises
    ------
    DataError
        If a line was flown far from its plan.
    """
    if not planned or ground is None:
        return {}
    time, height = np.array(planned).T
    rows = np.zeros(len(carrier), dtype=bool)
    for segment in segments:
        if not segment.turn:
            rows |= (carrier.time_s >= segment.start_s) & (carrier.time_s <= segment.stop_s)
    error = (carrier.alt_m - np.interp(carrier.time_s, time - zero_s, height))[rows]
    worst = int(np.argmax(np.abs(error)))
    if abs(error[worst]) > OFF_PLAN_M:
        msg = (
            f"the flight did not hold its drape: {error[worst]:.0f} m from the planned height at t = "
            f"{carrier.time_s[rows][worst]:.1f} s; allowed: up to {OFF_PLAN_M:g} (a smaller climb_slope, or less speed)"
        )
        raise DataError(msg)
    above = (carrier.alt_m - ground.height(carrier.lat_rad, carrier.lon_rad))[rows]
    return {
        "drape_worst_error_m": float(np.max(np.abs(error))),
        "drape_rms_error_m": float(np.sqrt(np.mean(error**2))),
        "drape_lowest_above_ground_m": float(above.min()),
        "drape_mean_above_ground_m": float(above.mean()),
        "drape_highest_above_ground_m": float(above.max()),
    }
