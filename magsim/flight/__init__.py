"""Flying: a scenario and its aircraft become a flight.

``plant`` is the flight model (JSBSim), ``autopilot`` its loops, ``guidance`` the pilot's eye on the line, ``patterns``
the lines, ``maneuvers`` the swings; ``fly`` joins them.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import jsbsim
import numpy as np

from magsim.aircraft import Aircraft, Facts
from magsim.earth.grid import grid_turn
from magsim.errors import DataError, RequestError
from magsim.flight.air import weather_of
from magsim.flight.calibration import check_reach, close_joints, loop_response, own_calibration
from magsim.flight.drape import HeightPlan, drape_notes, plan_path
from magsim.flight.elements import Element, length_of
from magsim.flight.flaps import check_legs, runs_of
from magsim.flight.guidance import TICK_HZ
from magsim.flight.maneuvers import UNITY, LoopResponse, measure
from magsim.flight.outcome import amplitude_notes, check_sweeps, pattern_notes, segments_of
from magsim.flight.patterns import LocalPlane, path_of
from magsim.flight.pilot import Log, Pilot, first_row_s, on_clock, planned_sweeps
from magsim.flight.plant import (
    FlightTroubleError,
    Setup,
    bare_steps,
    ground_speed,
)
from magsim.flight.rates import integrators_for, log_rate_hz
from magsim.flight.track import fly_track
from magsim.flight.watch import Watch
from magsim.scenario import (
    LogShear,
    PatternBase,
    Scenario,
    Track,
    TrackLog,
    ground_of,
    key_of,
    legs_allowed,
    needed_s,
    parts_of,
)
from magsim.terrain import Ground
from magsim.trajectory import Flight

__all__ = ["bare_run", "fly"]

MARGIN_S = 4.0
"""Flown and logged before the first row and after the last, for the run-in of filters."""

SLOWEST, GRACE_S = 1.3, 60.0
"""A flight that takes this many times as long as it should, and this much more, does not come to its end."""


def fly(
    scenario: Scenario,
    aircraft: Aircraft,
    *,
    ground: Ground | None = None,
    track: TrackLog | None = None,
    progress: Callable[[float], None] | None = None,
) -> Flight:
    """Fly a scenario.

    Parameters
    ----------
    scenario : Scenario
    aircraft : Aircraft
        The one that the scenario names.
    ground : Ground, optional
        That of a loaded scenario; without it, what ``scenario.terrain`` means without files.
    track : TrackLog, optional
        That of a loaded scenario with the pattern ``track``.
    progress : callable, optional
        Called with the part that is done, 0 to 1.

    Returns
    -------
    Flight
        Logged at ``scenario.flight.log_hz`` or the rate that the aircraft needs, from 4 s before the first row to
        4 s after the last.

    Raises
    ------
    RequestError
        If the pattern or its maneuvers do not fit the wind and the speed.
    DataError
        If the flight diverges, stalls, touches the ground or does not come to its end.
    """
    if ground is None:
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    if isinstance(scenario.pattern, Track):
        return _fly_log(scenario, aircraft, track, ground)
    aircraft = replace(aircraft, facts=scenario.loading.apply(aircraft.facts))
    plane, path, setup, heights = _plan(scenario, aircraft.facts, ground)
    _check_wind(scenario, path)
    check_legs(scenario.flight.flaps, path, _flying_time(scenario, path))
    parts = parts_of(scenario.pattern)
    # Swings are calibrated at the height of each part.
    setups = [replace(setup, alt_m=part.height_m(scenario.start.alt_m) or setup.alt_m) for part in parts]
    responses = [
        _calibrated(aircraft.facts, at, [element for element in path if element.label.part == number], parts)
        for number, at in enumerate(setups)
    ]
    warmup_s = scenario.flight.warmup_s
    log_hz = scenario.flight.log_hz or log_rate_hz(aircraft.facts, setup.step_hz)
    first_speed = ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps)
    pilot = Pilot(
        aircraft.facts,
        setup,
        plane=plane,
        path=path,
        along_m=-warmup_s * first_speed,
        log_hz=log_hz,
        response=responses,
        parts=parts,
        ground=ground,
        watch=Watch(aircraft.facts, scenario.flight, setup.speed_mps, 1.0 / TICK_HZ),
        heights=heights,
        flaps=scenario.flight.flaps,
    )
    expected_s = warmup_s + _flying_time(scenario, path) + MARGIN_S
    tick = None if progress is None else _progress(progress, expected_s)
    try:
        log = pilot.fly(_finished(expected_s), tick)
    except FlightTroubleError as error:
        raise DataError(error.told(error.time_s - warmup_s)) from None
    if progress is not None:
        progress(1.0)
    return _flight(scenario, aircraft, pilot, log, response=_told(responses), ground=ground)


def _calibrated(facts: Facts, setup: Setup, path: Sequence[Element], parts: Sequence[PatternBase]) -> LoopResponse:
    """What the loops make of the swings of a part of the path, at its height."""
    sweeps = planned_sweeps(path, parts, setup)
    if not sweeps:
        return UNITY
    response = loop_response(facts, tuple(dict.fromkeys(sweep.axis for sweep in sweeps)), setup)
    check_reach(sweeps, response, facts, setup)
    return close_joints(facts, setup, response, own_calibration(sweeps, response))


def _told(responses: Sequence[LoopResponse]) -> dict[str, np.ndarray]:
    """The first response that was measured, for the notes."""
    return next((response.arrays() for response in responses if response is not UNITY), {})


def _fly_log(scenario: Scenario, aircraft: Aircraft, track: TrackLog | None, ground: Ground | None) -> Flight:
    if track is None:
        msg = f"pattern.file: {scenario.pattern.file} is read by load_scenario only"
        raise RequestError(msg)
    return fly_track(scenario, aircraft, track, ground, MARGIN_S)


def bare_run(scenario: Scenario, aircraft: Aircraft, duration_s: float) -> None:
    """Step the same flight model at the same rate for a time and do nothing else: the yardstick of speed."""
    facts = scenario.loading.apply(aircraft.facts)
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    _, _, setup, _ = _plan(scenario, facts, ground)
    bare_steps(facts, setup, round(duration_s * setup.step_hz))


def _plan(
    scenario: Scenario, facts: Facts, ground: Ground | None = None
) -> tuple[LocalPlane, tuple[Element, ...], Setup, HeightPlan | None]:
    """The path, a start on its first leg's course that is one warm-up before its beginning, heights of a drape."""
    start, air = scenario.start, scenario.air
    plane = LocalPlane(math.radians(start.lat_deg), math.radians(start.lon_deg), start.alt_m)
    wind = air.wind_mps
    fastest = start.speed_mps + math.hypot(*wind)
    path = path_of(scenario.pattern, start.heading_deg, fastest, facts.autopilot.bank_ease.value)
    course = path[0].at(0.0).course
    before_m = scenario.flight.warmup_s * ground_speed(start.speed_mps, course, wind)
    before = path[0].at(-before_m)
    lat, lon = plane.geodetic(before.north_m, before.east_m)
    below = 0.0 if ground is None else float(ground.height(np.array(lat), np.array(lon)))
    heights = plan_path(
        path,
        parts_of(scenario.pattern),
        plane,
        ground,
        alt_m=start.alt_m,
        climb_mps=facts.autopilot.climb_limit.value,
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
    setup = Setup(
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
    return plane, path, setup, heights


def _longest(scenario: Scenario, path: Sequence[Element]) -> float:
    """Time from the first row within which every flight of a path is over [s]."""
    return SLOWEST * (scenario.flight.warmup_s + _flying_time(scenario, path) + MARGIN_S) + GRACE_S


def _leg_time(scenario: Scenario, element: Element) -> float:
    wind = (scenario.air.wind_north_mps, scenario.air.wind_east_mps)
    speed = ground_speed(scenario.start.speed_mps, math.radians(element.heading_deg), wind)
    return element.length_m / max(1.0, speed)


def _flying_time(scenario: Scenario, path: Sequence[Element]) -> float:
    """Time that a path takes, turns at the airspeed less half of the wind [s]."""
    wind = math.hypot(scenario.air.wind_north_mps, scenario.air.wind_east_mps)
    turning = max(1.0, scenario.start.speed_mps - 0.5 * wind)
    legs = math.fsum(_leg_time(scenario, element) for element in path if not element.turn)
    return legs + length_of([element for element in path if element.turn]) / turning


def _check_wind(scenario: Scenario, path: Sequence[Element]) -> None:
    """Trains must end before their leg does, at the speed over ground that the wind leaves."""
    parts = parts_of(scenario.pattern)
    for element in path:
        pattern = parts[element.label.part]
        if element.turn or not pattern.maneuvers:
            continue
        available = _leg_time(scenario, element)
        needed = needed_s(pattern, element.label.index, available) - pattern.maneuvers[-1].rest_s
        if needed > available:
            key = key_of(scenario.pattern, element.label.part)
            msg = (
                f"{key}.maneuvers: with the wind of [air], leg {element.leg} of "
                f"circuit {element.circuit} is flown in {available:.0f} s, but its maneuvers need {needed:.0f} s; "
                f"{legs_allowed(pattern, element.length_m / available)}, or less wind"
            )
            raise RequestError(msg)


def _finished(expected_s: float) -> Callable[[Pilot], bool]:
    """Say when a run is over: a margin after the end of its path."""
    longest = SLOWEST * expected_s + GRACE_S

    def finished(pilot: Pilot) -> bool:
        end, now = pilot.guidance.finished_s, pilot.plant.time_s
        if pilot.plant.fuel_kg <= 0.0:
            msg = f"the fuel was burned {now:.0f} s after the start; allowed: more of loading.fuel_kg"
            raise DataError(msg)
        if end is None and now > longest:
            element = pilot.path[pilot.guidance.index]
            where = f"{'the turn after ' if element.turn else ''}leg {element.leg} of circuit {element.circuit}"
            entered = "was not entered" if not pilot.guidance.crossings else "was not finished"
            trouble = f"missed its pattern: {where} {entered}, {pilot.guidance.off_m:.0f} m right of its line,"
            raise FlightTroubleError(trouble, pilot.plant.row, now)
        return end is not None and now >= end + MARGIN_S + 1.0 / TICK_HZ

    return finished


def _progress(progress: Callable[[float], None], expected_s: float) -> Callable[[Pilot], None]:
    """Report about two hundred times in a flight."""
    every = max(1, round(expected_s * TICK_HZ / 200.0))
    count = 0

    def tick(pilot: Pilot) -> None:
        nonlocal count
        count += 1
        if count % every == 0:
            progress(min(0.999, pilot.plant.time_s / expected_s))

    return tick


def _flight(
    scenario: Scenario,
    aircraft: Aircraft,
    pilot: Pilot,
    log: Log,
    *,
    response: dict[str, np.ndarray],
    ground: Ground | None,
) -> Flight:
    """Cut the log and tell what was flown."""
    crossings, end = pilot.guidance.crossings, pilot.guidance.finished_s
    log_hz, rate_hz = pilot.log_hz, scenario.recording.rate_hz
    zero = first_row_s(crossings[0].time_s, log_hz)
    log = log.cut(zero - MARGIN_S, end + MARGIN_S, zero)
    carrier = log.trajectory(aircraft.facts.cg_b)
    duration = math.floor((end - zero) * rate_hz + 1e-9) / rate_hz
    pilot.flaps.check()
    segments = segments_of(crossings, pilot.path, zero, end, carrier)
    sweeps = [on_clock(sweep, zero) for sweep in pilot.sweeps]
    check_sweeps(sweeps, segments)
    maneuvers, parts = tuple(measure(sweep, carrier)[0] for sweep in sweeps), parts_of(scenario.pattern)
    return Flight(
        carrier=carrier,
        duration_s=duration,
        simulation_rate_hz=float(scenario.flight.step_hz),
        controls=log.controls(),
        switches=log.switches(),
        wind_n=log.wind(),
        rotors=log.rotors(aircraft.facts.engine),
        segments=segments,
        maneuvers=maneuvers,
        notes={
            "jsbsim": str(jsbsim.__version__),
            "integrators": integrators_for(aircraft.facts, scenario.flight.step_hz),
            "step_hz": scenario.flight.step_hz,
            "log_hz": log_hz,
            "warmup_s": scenario.flight.warmup_s,
            "mass_kg": aircraft.facts.mass_kg,
            "fuel_left_kg": pilot.plant.fuel_kg,
            "loop_response": {name: values.tolist() for name, values in response.items()},
            **pattern_notes(scenario, pilot.path, carrier, segments, sweeps),
            **amplitude_notes(maneuvers),
            "flap_runs": runs_of(log.time_s, log["flap"]),
            **drape_notes(pilot.planned, zero, segments, carrier, ground=ground, parts=parts),
        },
    )
