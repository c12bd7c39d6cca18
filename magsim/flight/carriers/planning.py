"""The plan of a flight: path, start, heights, expected duration."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim.aircraft import Facts, KinematicFacts
from magsim.earth.grid import grid_turn
from magsim.errors import RequestError
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.weather import weather_of
from magsim.flight.path.elements import Element, length_of
from magsim.flight.path.heights import HeightPlan, plan_path
from magsim.flight.path.patterns import path_of
from magsim.flight.path.plane import LocalPlane
from magsim.flight.path.wind import ground_speed
from magsim.planning import legs_allowed, needed_s
from magsim.scenario import LegPattern, LogShear, PatternSequence, Scenario, TrackPattern, key_of, parts_of
from magsim.terrain import Ground

MARGIN_S = 4.0
"""Time flown and logged before the first row and after the last, for the run-in of filters."""

SLOWEST, GRACE_S = 1.3, 60.0
"""A flight that takes this many times as long as it should, and this much more, counts as stuck."""


class FlightPlan(NamedTuple):
    """The plan of a flight: its path in a plane, where and how it begins, heights of a drape."""

    plane: LocalPlane
    path: tuple[Element, ...]
    setup: PlantSetup
    heights: HeightPlan | None
    ground_m: float
    """Ground at the start point, from which a logarithmic shear counts, above the ellipsoid."""


def legs_of(scenario: Scenario) -> LegPattern | PatternSequence:
    """Return the pattern of a scenario that does not fly a logged track."""
    assert not isinstance(scenario.pattern, TrackPattern)
    return scenario.pattern


def warmup_s(scenario: Scenario) -> float:
    """Return the time flown before the path's beginning [s]: for the autopilot, and for a towed bird to settle."""
    return scenario.flight.warmup_s + settle_s(scenario)


def settle_s(scenario: Scenario) -> float:
    """Return the time in which a towed bird settles before the first row [s]; 0 without one."""
    return scenario.tow.settle_s if scenario.tow else 0.0


def plan_flight(scenario: Scenario, facts: Facts | KinematicFacts, ground: Ground | None = None) -> FlightPlan:
    """Plan the path and a start on the first leg's course, one warm-up before its beginning.

    Raises
    ------
    RequestError
        If the pattern does not fit the speed, or the flight would begin in the ground.
    """
    start, air = scenario.start, scenario.air
    plane = LocalPlane(math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m)
    wind = air.wind_mps
    fastest = start.speed_mps + math.hypot(*wind)
    path = path_of(legs_of(scenario), start.heading_deg, fastest, facts.bank_ease_s)
    course = path[0].at(0.0).course
    before_m = warmup_s(scenario) * ground_speed(start.speed_mps, course, wind)
    before = path[0].at(-before_m)
    lat, lon = plane.geodetic(before.north_m, before.east_m)
    below = 0.0 if ground is None else float(ground.height(np.array(lat), np.array(lon)))
    heights = plan_path(
        path,
        parts_of(legs_of(scenario)),
        plane,
        ground,
        alt_m=start.alt_m,
        climb_mps=facts.climb_mps,
        speed_mps=fastest,
        before_m=before_m,
        after_m=2.0 * MARGIN_S * fastest,
        ceiling_m=facts.limits.ceiling.value,
    )
    alt_m = start.alt_m if heights is None else heights.at(-before_m)
    if below >= alt_m:
        msg = (
            f"start.alt_m: {start.alt_m:g} m is not above the ground where the flight begins, {below:.1f} m above the "
            "ellipsoid; allowed: above that"
        )
        raise RequestError(msg)
    # The wind of the scenario holds at the start point; a logarithmic shear counts from the ground there.
    at_start = 0.0 if ground is None else float(ground.height(np.array(plane.lat_rad), np.array(plane.lon_rad)))
    first_m = start.alt_m if heights is None else heights.at(0.0)
    reference = first_m - at_start if isinstance(air.shear, LogShear) else first_m
    setup = PlantSetup(
        lat_rad=lat,
        lon_rad=lon,
        alt_m=alt_m,
        course=course - plane.north_at(lat, lon),
        speed_mps=start.speed_mps,
        wind_mps=wind,
        step_hz=scenario.flight.step_hz,
        ground_m=below,
        weather=weather_of(air, scenario.seed, reference, _longest(scenario, path)),
        flap_rad=math.radians(start.flap_deg),
        burn=scenario.loading.burn_fuel,
        grid=grid_turn(plane.lat_rad),
        grid_lon=plane.lon_rad,
    )
    return FlightPlan(plane, path, setup, heights, at_start)


def longest_s(expected_s: float) -> float:
    """Return the time [s] within which a flight of an expected duration must end."""
    return SLOWEST * expected_s + GRACE_S


def _longest(scenario: Scenario, path: Sequence[Element]) -> float:
    """Return the time [s] from the first row within which every flight of a path must end."""
    return longest_s(warmup_s(scenario) + flying_time(scenario, path) + MARGIN_S)


def _leg_time(scenario: Scenario, element: Element) -> float:
    wind = (scenario.air.wind_north_mps, scenario.air.wind_east_mps)
    speed = ground_speed(scenario.start.speed_mps, math.radians(element.heading_deg), wind)
    return element.length_m / max(1.0, speed)


def flying_time(scenario: Scenario, path: Sequence[Element]) -> float:
    """Return the time that a path takes [s], turns at the airspeed less half of the wind."""
    wind = math.hypot(scenario.air.wind_north_mps, scenario.air.wind_east_mps)
    turning = max(1.0, scenario.start.speed_mps - 0.5 * wind)
    legs = math.fsum(_leg_time(scenario, element) for element in path if not element.turn)
    return legs + length_of([element for element in path if element.turn]) / turning


def check_wind(scenario: Scenario, path: Sequence[Element]) -> None:
    """Check that trains end before their leg does, at the speed over ground in this wind.

    Raises
    ------
    RequestError
        If one does not.
    """
    parts = parts_of(legs_of(scenario))
    for element in path:
        pattern = parts[element.label.part]
        if element.turn or not pattern.maneuvers:
            continue
        available = _leg_time(scenario, element)
        needed = needed_s(pattern, element.label.leg_index, available) - pattern.maneuvers[-1].rest_s
        if needed > available:
            key = key_of(legs_of(scenario), element.label.part)
            msg = (
                f"{key}.maneuvers: with the wind of [air], leg {element.leg} of "
                f"circuit {element.circuit} is flown in {available:.0f} s, but its maneuvers need {needed:.0f} s; "
                f"{legs_allowed(pattern, element.length_m / available)}, or less wind"
            )
            raise RequestError(msg)
