"""Flying: a scenario and its aircraft become a flight.

``plant`` is the flight model (JSBSim), ``autopilot`` its loops, ``guidance`` the pilot's eye on the line, ``patterns``
the lines, ``maneuvers`` the swings; ``fly`` joins them.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import jsbsim
import numpy as np

from magsim.aircraft import Aircraft, Bird, Facts, KinematicFacts
from magsim.earth.atmosphere import standard_density
from magsim.errors import DataError, RequestError
from magsim.flight.calibration import check_reach, close_joints, loop_response, own_calibration
from magsim.flight.drape import drape_notes
from magsim.flight.elements import Element
from magsim.flight.flaps import check_legs, runs_of
from magsim.flight.guidance import TICK_HZ
from magsim.flight.kinematic import fly_kinematic
from magsim.flight.maneuvers import UNITY, LoopResponse, measure
from magsim.flight.outcome import amplitude_notes, check_height, check_sweeps, pattern_notes, segments_of
from magsim.flight.pilot import Log, Pilot, first_row_s, on_clock, planned_sweeps
from magsim.flight.planning import MARGIN_S, check_wind, flying_time, longest_s, plan, settle_s, warmup_s
from magsim.flight.plant import FlightTroubleError, Setup, bare_steps, ground_speed
from magsim.flight.rates import integrators_for, log_rate_hz
from magsim.flight.track import fly_track
from magsim.flight.watch import Watch
from magsim.scenario import PatternBase, Scenario, TrackLog, TrackPattern, ground_of, parts_of
from magsim.terrain import Ground
from magsim.trajectory import Flight

if TYPE_CHECKING:
    from magsim.flight.tow.swing import Swing

__all__ = ["bare_run", "fly"]


def fly(
    scenario: Scenario,
    aircraft: Aircraft,
    *,
    bird: Bird | None = None,
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
    bird : Bird, optional
        The one that it tows.
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
        4 s after the last; with what is towed.

    Raises
    ------
    RequestError
        If the pattern or its maneuvers do not fit the wind and the speed, or the bird cannot be towed.
    DataError
        If the flight diverges, stalls, touches the ground or does not come to its end; if the rope goes slack.
    """
    if ground is None:
        ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    if scenario.tow is None:
        return _fly_carrier(scenario, aircraft, None, ground=ground, track=track, progress=progress)[0]
    if bird is None:
        msg = f"tow.bird: {scenario.tow.bird} is read by load_scenario only"
        raise RequestError(msg)
    tell = (lambda _share: None) if progress is None else progress
    # the equations are compiled: seconds that flights without a bird need not wait
    from magsim.flight.tow.setup import equilibrium
    from magsim.flight.tow.towing import tow_bird

    # what cannot hang is told before the carrier has flown
    equilibrium(scenario.tow, bird, scenario.start.speed_mps, float(standard_density(scenario.start.alt_m)))
    flight, flown = _fly_carrier(
        scenario, aircraft, bird, ground=ground, track=track, progress=lambda share: tell(0.8 * share)
    )
    flight = tow_bird(flight, scenario, aircraft, bird, flown).since(-MARGIN_S)
    check_height(flight, ground)
    tell(1.0)
    return flight


def _fly_carrier(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird | None,
    *,
    ground: Ground | None,
    track: TrackLog | None,
    progress: Callable[[float], None] | None,
) -> "tuple[Flight, Swing | None]":
    """The carrier's flight, whose log begins early enough for a bird to swing in, and how one swung that pulled."""
    if isinstance(scenario.pattern, TrackPattern):
        return _fly_log(scenario, aircraft, track, ground), None
    if isinstance(aircraft.facts, KinematicFacts):
        return fly_kinematic(scenario, aircraft, ground), None
    return _fly_model(scenario, aircraft, bird, ground, progress)


def _fly_model(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird | None,
    ground: Ground | None,
    progress: Callable[[float], None] | None,
) -> "tuple[Flight, Swing | None]":
    """The flight of a flight model, and how a bird swung that pulled on it."""
    aircraft = replace(aircraft, facts=scenario.loading.apply(aircraft.facts))
    plane, path, setup, heights, _ = plan(scenario, aircraft.facts, ground)
    check_wind(scenario, path)
    check_legs(scenario.flight.flaps, path, flying_time(scenario, path))
    parts = parts_of(scenario.pattern)
    # Swings are calibrated at the height of each part.
    setups = [replace(setup, alt_m=part.height_m(scenario.start.alt_m) or setup.alt_m) for part in parts]
    responses = [
        _calibrated(aircraft.facts, at, [element for element in path if element.label.part == number], parts)
        for number, at in enumerate(setups)
    ]
    before_s = warmup_s(scenario)
    log_hz = scenario.flight.log_hz or log_rate_hz(aircraft.facts, setup.step_hz)
    first_speed = ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps)
    coupled = None
    if bird is not None:
        from magsim.flight.tow.setup import coupled_line, hook_of

        coupled = coupled_line(scenario, aircraft, bird, step_hz=setup.step_hz, log_hz=log_hz, alt_m=setup.alt_m)
    if coupled is not None:
        setup = replace(setup, hook_b=hook_of(scenario.tow, aircraft))
    pilot = Pilot(
        aircraft.facts,
        setup,
        plane=plane,
        path=path,
        along_m=-before_s * first_speed,
        log_hz=log_hz,
        response=responses,
        parts=parts,
        ground=ground,
        watch=Watch(aircraft.facts, scenario.flight, setup.speed_mps, 1.0 / TICK_HZ),
        heights=heights,
        flaps=scenario.flight.flaps,
        coupled=coupled,
    )
    expected_s = before_s + flying_time(scenario, path) + MARGIN_S
    tick = None if progress is None else _progress(progress, expected_s)
    try:
        log = pilot.fly(_finished(expected_s), tick)
    except FlightTroubleError as error:
        raise DataError(error.told(error.time_s - before_s)) from None
    if progress is not None:
        progress(1.0)
    flight = _flight(scenario, aircraft, pilot, log, response=_told(responses), ground=ground)
    if coupled is None:
        return flight, None
    zero = first_row_s(pilot.guidance.crossings[0].time_s, log_hz)
    begun, ended = flight.carrier.time_s[[0, -1]] + zero
    return flight, coupled.flown(begun, ended, zero, log_hz)


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
    return fly_track(scenario, aircraft, track, ground, (MARGIN_S + settle_s(scenario), MARGIN_S))


def bare_run(scenario: Scenario, aircraft: Aircraft, duration_s: float) -> None:
    """Step the same flight model at the same rate for a time and do nothing else: the yardstick of speed."""
    facts = scenario.loading.apply(aircraft.facts)
    ground = ground_of(scenario.terrain, scenario.start, scenario.seed, None)
    setup = plan(scenario, facts, ground).setup
    bare_steps(facts, setup, round(duration_s * setup.step_hz))


def _finished(expected_s: float) -> Callable[[Pilot], bool]:
    """Say when a run is over: a margin after the end of its path."""
    longest = longest_s(expected_s)

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
    log = log.cut(zero - MARGIN_S - settle_s(scenario), end + MARGIN_S, zero)
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
            "warmup_s": warmup_s(scenario),
            "mass_kg": aircraft.facts.mass_kg,
            "fuel_left_kg": pilot.plant.fuel_kg,
            "loop_response": {name: values.tolist() for name, values in response.items()},
            **pattern_notes(scenario, pilot.path, carrier, segments, sweeps),
            **amplitude_notes(maneuvers),
            "flap_runs": runs_of(log.time_s, log["flap"]),
            **drape_notes(pilot.planned, zero, segments, carrier, ground=ground, parts=parts),
        },
    )
