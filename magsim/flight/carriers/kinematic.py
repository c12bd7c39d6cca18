"""Flying a carrier without a flight model: along its path at its airspeed, with the sway of air and hands.

The path is that of its pattern; speed over ground follows from airspeed and steady wind. Sway is noise about the path
in all three directions. The attitude is that of a coordinated flight along the curve that is flown, sway included: the
nose points where the air comes from, but for a part of its own (gusts and pedals); bank follows from the acceleration
to the right, pitch from drag and the acceleration forward.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from magsim.aircraft import Aircraft, KinematicFacts
from magsim.earth import ecef_from_geodetic, geodetic_from_ecef, rot_ne_at, transport_rate
from magsim.earth.atmosphere import standard_density
from magsim.earth.gravity import gravity_n
from magsim.flight.carriers.outcome import check_height, pattern_notes, segments_of
from magsim.flight.carriers.planning import MARGIN_S, FlightPlan, check_wind, plan_flight, settle_s, warmup_s
from magsim.flight.carriers.sway import SwaySize, sway
from magsim.flight.model.rates import log_rate_hz
from magsim.flight.path.elements import Element, length_of
from magsim.flight.path.heights import STEP_M, HeightPlan
from magsim.flight.path.wind import ground_speed
from magsim.flight.pilot.guidance import Crossing
from magsim.frames import rot_nb_from_attitude, rotate, rotate_back
from magsim.scenario import Scenario, Sway
from magsim.scenario.air import wind_at
from magsim.terrain import Ground, TangentPlane
from magsim.trajectory import AttitudeCurve, Flight, Trajectory

SPACING_M = 1.0
"""Of the table of courses along a path."""


MOTION_HZ = 30.0
"""Position and attitude are curves through points of a grid of their own: a denser log must not be a rougher flight.

The attitude follows from second derivatives of the place, and the motion of a hook under the belly from
second derivatives of the attitude: on a much denser grid they would be dominated by rounding.
"""


class PathCurves(NamedTuple):
    """A path in the plane, without sway.

    ``along_m`` is a function of time [s], the others of the distance along the path [m]; ``course`` is in rad.
    """

    along_m: CubicSpline
    north_m: CubicSpline
    east_m: CubicSpline
    course: CubicSpline
    height_m: CubicSpline


def fly_kinematic(scenario: Scenario, aircraft: Aircraft, ground: Ground | None) -> Flight:
    """Fly a kinematic carrier.

    Parameters
    ----------
    scenario : Scenario
    aircraft : Aircraft
        With ``KinematicFacts``.
    ground : Ground, optional

    Returns
    -------
    Flight
        Logged from 4 s before the first row, and ``tow.settle_s`` earlier where a bird is towed, to 4 s after the
        last; it has neither controls nor switches.

    Raises
    ------
    RequestError
        If the pattern does not fit the speed.
    DataError
        If it touches the ground.
    """
    facts = aircraft.facts
    assert isinstance(facts, KinematicFacts)
    scenario.loading.apply(facts)
    planned = plan_flight(scenario, facts, ground)
    check_wind(scenario, planned.path)
    way = _course_of(scenario, planned)
    ends = np.cumsum([0.0, *(element.length_m for element in planned.path)])
    crossed = [_time_at(way, end) for end in ends]
    end_s, rate_hz = crossed[-1], scenario.recording.rate_hz
    log_hz = scenario.flight.log_hz or log_rate_hz(facts, scenario.flight.step_hz)
    before_s = MARGIN_S + settle_s(scenario)
    grid = np.arange(-round(before_s * log_hz), math.floor((end_s + MARGIN_S) * log_hz) + 1) / log_hz
    size = _sway_size(scenario, facts)
    carrier, wind_n = _motion(scenario, facts, planned, way, time_s=grid, size=size)
    crossings = [Crossing(i, time) for i, time in enumerate(crossed[:-1])]
    segments = segments_of(crossings, planned.path, 0.0, end_s, carrier)
    flight = Flight(
        carrier=carrier,
        duration_s=math.floor(end_s * rate_hz + 1e-9) / rate_hz,
        simulation_rate_hz=float(scenario.flight.step_hz),
        controls={},
        segments=segments,
        maneuvers=(),
        wind_n=wind_n,
        notes={
            "carrier": "kinematic: prescribed path with sway, attitude from path and speed, no flight model",
            "sway_along_m": size.along_m,
            "sway_lateral_m": size.lateral_m,
            "sway_vertical_m": size.vertical_m,
            "sway_heading_deg": math.degrees(size.heading_rad),
            "log_hz": log_hz,
            "warmup_s": warmup_s(scenario),
            **pattern_notes(scenario, planned.path, carrier, segments, []),
        },
    )
    check_height(flight, ground)
    return flight


def _course_of(scenario: Scenario, planned: FlightPlan) -> PathCurves:
    """Return course, place and time along a path: time 0 is the path's beginning."""
    speed = scenario.start.speed_mps
    fastest = speed + math.hypot(*scenario.air.wind_mps)
    before, after = (warmup_s(scenario) + 2.0 * MARGIN_S) * fastest, 3.0 * MARGIN_S * fastest
    table = _courses(planned.path, before, after)
    along, course = table[:, 0], table[:, 1]
    heights = planned.heights
    level = scenario.start.alt_m
    height = np.full(len(along), level) if heights is None else _smooth_heights(heights, along)
    winds = {alt: wind_at(scenario.air, scenario.start, alt, planned.ground_m) for alt in set(height.tolist())}
    over_ground = [ground_speed(speed, c, winds[h]) for c, h in zip(course.tolist(), height.tolist(), strict=True)]
    # time along the path, by the integral of its inverse speed from the path's beginning
    clock = CubicSpline(along, 1.0 / np.array(over_ground)).antiderivative()
    time = clock(along) - clock(0.0)
    north, east = (CubicSpline(along, part).antiderivative() for part in (np.cos(course), np.sin(course)))
    first = planned.path[0].at(0.0)
    return PathCurves(
        CubicSpline(time, along),
        _moved(north, first.north_m - float(north(0.0))),
        _moved(east, first.east_m - float(east(0.0))),
        CubicSpline(along, course),
        CubicSpline(along, height),
    )


def _smooth_heights(plan: HeightPlan, along_m: np.ndarray) -> np.ndarray:
    """Return planned heights [m] without the corners of straight lines between the plan's points; level beyond it.

    A carrier that followed each corner exactly would be jerked by it, and its bird too.
    """
    points = plan.first_m + STEP_M * np.arange(len(plan.height_m))
    return CubicSpline(points, plan.height_m)(np.clip(along_m, points[0], points[-1]))


def _moved(curve: CubicSpline, by: float) -> CubicSpline:
    """Add a constant to a curve, in place."""
    curve.c[-1] += by
    return curve


def _courses(path: Sequence[Element], before_m: float, after_m: float) -> np.ndarray:
    """Return distance along a path and continuous course, (n, 2), from before its beginning to after its end."""
    starts = np.cumsum([0.0, *(element.length_m for element in path)])
    count = math.ceil((before_m + length_of(path) + after_m) / SPACING_M)
    along = -before_m + SPACING_M * np.arange(count + 1)
    index = np.clip(np.searchsorted(starts, along, side="right") - 1, 0, len(path) - 1)
    courses = [path[i].at(s - starts[i]).course for i, s in zip(index.tolist(), along.tolist(), strict=True)]
    return np.column_stack([along, np.unwrap(courses)])


def _time_at(way: PathCurves, along_m: float) -> float:
    """Return the time [s] at which a distance along the path is reached."""
    times, alongs = way.along_m.x, way.along_m(way.along_m.x)
    guess = float(np.interp(along_m, alongs, times))
    for _ in range(3):
        guess -= float(way.along_m(guess) - along_m) / float(way.along_m(guess, 1))
    return guess


def _sway_size(scenario: Scenario, facts: KinematicFacts) -> SwaySize:
    """Return the standard deviations of the sway: those of the scenario, else those of the carrier's file."""
    own, asked = facts.sway, scenario.flight.sway or Sway()
    heading_deg = own.heading.value if asked.heading_deg is None else asked.heading_deg
    return SwaySize(
        own.along.value if asked.along_m is None else asked.along_m,
        own.lateral.value if asked.lateral_m is None else asked.lateral_m,
        own.vertical.value if asked.vertical_m is None else asked.vertical_m,
        math.radians(heading_deg),
    )


def _motion(
    scenario: Scenario,
    facts: KinematicFacts,
    planned: FlightPlan,
    way: PathCurves,
    *,
    time_s: np.ndarray,
    size: SwaySize,
) -> tuple[Trajectory, np.ndarray]:
    """Return the trajectory of the center of gravity and the wind at its rows."""
    first, last = math.floor(time_s[0] - 1.0), math.ceil(time_s[-1] + 1.0)
    points_s = np.arange(round(first * MOTION_HZ), round(last * MOTION_HZ) + 1) / MOTION_HZ
    ahead, right, down, nose = sway(points_s, size, facts.sway.band.value, scenario.seed).T
    along = way.along_m(points_s)
    course, height = way.course(along), way.height_m(along)
    sin, cos = np.sin(course), np.cos(course)
    plane = TangentPlane(planned.plane.lat_rad, planned.plane.lon_rad, planned.plane.alt_m)
    north, east = way.north_m(along) + ahead * cos - right * sin, way.east_m(along) + ahead * sin + right * cos
    lat, lon = plane.geodetic(north, east)
    curve = CubicSpline(points_s, ecef_from_geodetic(lat, lon, height - down))
    turning = _turning(scenario, facts, planned, way, points_s=points_s, curve=curve, nose=nose)
    lat, lon, alt = geodetic_from_ecef(curve(time_s))
    lon = np.unwrap(lon)
    velocity_n = rotate(rot_ne_at(lat, lon), curve(time_s, 1))
    attitude, rate_eb_b = turning.at(time_s, lat, lon)
    rate_b = rate_eb_b - rotate_back(rot_nb_from_attitude(attitude), transport_rate(lat, alt, velocity_n))
    carrier = Trajectory(time_s, lat, lon, alt, velocity_n, attitude, rate_b, np.array(facts.cg_b))
    return carrier, _wind_along(scenario, planned, way, time_s, rot_ne_at(lat, lon))


def _wind_along(
    scenario: Scenario, planned: FlightPlan, way: PathCurves, time_s: np.ndarray, rot_ne: np.ndarray
) -> np.ndarray:
    """Return the wind at times, at places of known axes, north, east, down, (n, 3) [m/s]."""
    heights = way.height_m(way.along_m(time_s)).tolist()
    winds = np.array([wind_at(scenario.air, scenario.start, height, planned.ground_m) for height in heights])
    # its components are those along the plane's north and east
    plane = rot_ne_at(planned.plane.lat_rad, planned.plane.lon_rad)
    wind_n = np.einsum("nik,nk->ni", np.einsum("nij,kj->nik", rot_ne, plane[:2]), winds)
    wind_n[:, 2] = 0.0  # horizontal at its place, not at the plane's origin
    return wind_n


def _turning(
    scenario: Scenario,
    facts: KinematicFacts,
    planned: FlightPlan,
    way: PathCurves,
    *,
    points_s: np.ndarray,
    curve: CubicSpline,
    nose: np.ndarray,
) -> AttitudeCurve:
    """Return the attitude along a curve of places through points in time; the nose is off the air by an angle [rad]."""
    lat, lon, alt = geodetic_from_ecef(curve(points_s))
    lon = np.unwrap(lon)
    rot_ne = rot_ne_at(lat, lon)
    air_n = rotate(rot_ne, curve(points_s, 1)) - _wind_along(scenario, planned, way, points_s, rot_ne)
    heading = np.unwrap(np.arctan2(air_n[:, 1], air_n[:, 0])) + nose
    acceleration_n = rotate(rot_ne, curve(points_s, 2))
    speed = scenario.start.speed_mps
    attitude = _attitude(facts, speed, alt, acceleration_n, gravity_n(lat, alt)[:, 2], heading=heading)
    return AttitudeCurve(points_s, lat, lon, attitude)


def _attitude(
    facts: KinematicFacts,
    speed_mps: float,
    alt_m: np.ndarray,
    acceleration_n: np.ndarray,
    gravity: np.ndarray,
    *,
    heading: np.ndarray,
) -> np.ndarray:
    """Return the attitude of a rotor that balances weight, drag and acceleration, (n, 3) [rad]."""
    drag = 0.5 * standard_density(alt_m) * speed_mps**2 * facts.drag_area.value / facts.mass.value
    cos, sin = np.cos(heading), np.sin(heading)
    ahead = acceleration_n[:, 0] * cos + acceleration_n[:, 1] * sin + drag
    aside = acceleration_n[:, 1] * cos - acceleration_n[:, 0] * sin
    lifted = gravity - acceleration_n[:, 2]
    pitch = -np.arctan2(ahead, lifted)
    roll = np.arctan2(aside, np.hypot(ahead, lifted))
    return np.column_stack([roll, pitch, heading])
