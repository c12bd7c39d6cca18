"""Flying a carrier by its flight model: JSBSim under an autopilot and a pilot."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import jsbsim
import numpy as np

from magsim.aircraft import Aircraft, Bird, Facts
from magsim.errors import DataError
from magsim.flight.carriers.outcome import (
    amplitude_notes,
    check_trains,
    drape_notes,
    pattern_notes,
    segments_of,
)
from magsim.flight.carriers.planning import (
    MARGIN_S,
    check_wind,
    flying_time,
    legs_of,
    longest_s,
    plan_flight,
    settle_s,
    warmup_s,
)
from magsim.flight.model.plant import FlightTroubleError
from magsim.flight.model.rates import integrators_for, log_rate_hz
from magsim.flight.model.setup import PlantSetup
from magsim.flight.path.wind import ground_speed
from magsim.flight.pilot.calibration import calibrate_maneuvers, check_reach, loop_response, maneuvers_to_calibrate
from magsim.flight.pilot.flaps import check_legs, runs_of
from magsim.flight.pilot.log import Log
from magsim.flight.pilot.measure import measure
from magsim.flight.pilot.monitor import FlightMonitor
from magsim.flight.pilot.pilot import Pilot, first_row_s, on_clock, planned_trains
from magsim.flight.pilot.response import UNITY, LoopResponse
from magsim.flight.pilot.steering import TICK_HZ
from magsim.flight.pilot.trains import SineTrain
from magsim.flight.tow.motion import BirdMotion
from magsim.scenario import Scenario, parts_of
from magsim.terrain import Ground
from magsim.trajectory import Flight


def fly_modeled(
    scenario: Scenario,
    aircraft: Aircraft,
    bird: Bird | None,
    ground: Ground | None,
    progress: Callable[[float], None] | None,
) -> tuple[Flight, BirdMotion | None]:
    """Fly a flight model; return also the motion of a bird that pulled on it."""
    facts = scenario.loading.apply(aircraft.facts)
    assert isinstance(facts, Facts)
    aircraft = replace(aircraft, facts=facts)
    plane, path, setup, heights, _ = plan_flight(scenario, facts, ground)
    check_wind(scenario, path)
    check_legs(scenario.flight.flaps, path, flying_time(scenario, path))
    parts = parts_of(legs_of(scenario))
    # Maneuvers are calibrated at the height of each part.
    setups = [replace(setup, alt_m=part.height_m(scenario.start.alt_m) or setup.alt_m) for part in parts]
    responses = [
        _calibrated(facts, at, planned_trains([e for e in path if e.label.part == number], parts, at, scenario.seed))
        for number, at in enumerate(setups)
    ]
    before_s = warmup_s(scenario)
    log_hz = scenario.flight.log_hz or log_rate_hz(facts, setup.step_hz)
    first_speed = ground_speed(setup.speed_mps, setup.course, setup.local_wind_mps)
    coupled = None
    if bird is not None and scenario.tow is not None:
        from magsim.flight.tow.setup import coupled_chain, hook_of

        coupled = coupled_chain(scenario, aircraft, bird, step_hz=setup.step_hz, log_hz=log_hz, alt_m=setup.alt_m)
        if coupled is not None:
            setup = replace(setup, hook_b=hook_of(scenario.tow, aircraft))
    pilot = Pilot(
        facts,
        setup,
        plane=plane,
        path=path,
        along_m=-before_s * first_speed,
        log_hz=log_hz,
        response=responses,
        parts=parts,
        ground=ground,
        monitor=FlightMonitor(facts, scenario.flight, setup.speed_mps, 1.0 / TICK_HZ),
        heights=heights,
        flaps=scenario.flight.flaps,
        coupled=coupled,
        seed=scenario.seed,
    )
    expected_s = before_s + flying_time(scenario, path) + MARGIN_S
    tick = None if progress is None else _progress(progress, expected_s)
    try:
        log = pilot.fly(_finished(expected_s, burn=setup.burn), tick)
    except FlightTroubleError as error:
        raise DataError(error.message(error.time_s - before_s)) from None
    if progress is not None:
        progress(1.0)
    flight = _flight(scenario, facts, pilot, log, response=_response_notes(responses), ground=ground)
    if coupled is None:
        return flight, None
    zero = first_row_s(pilot.guidance.crossings[0].time_s, log_hz)
    begun, ended = flight.carrier.time_s[[0, -1]] + zero
    return flight, coupled.flown(begun, ended, zero, log_hz)


def _calibrated(facts: Facts, setup: PlantSetup, trains: Sequence[SineTrain]) -> LoopResponse:
    """Calibrate the loops for the maneuvers of a part of the path, at its height."""
    if not trains:
        return UNITY
    axes = [train.axis for train in trains] + ["roll" for train in trains if train.roll_part]
    response = loop_response(facts, tuple(dict.fromkeys(axes)), setup)
    check_reach(trains, response, facts, setup)
    return calibrate_maneuvers(facts, setup, response, maneuvers_to_calibrate(trains, response))


def _response_notes(responses: Sequence[LoopResponse]) -> dict[str, np.ndarray]:
    """Return the first measured response, for the notes."""
    return next((response.arrays() for response in responses if response is not UNITY), {})


def _finished(expected_s: float, *, burn: bool) -> Callable[[Pilot], bool]:
    """Return the check for the end of a run: a margin after the end of its path, or the end of fuel that burns."""
    longest = longest_s(expected_s)

    def finished(pilot: Pilot) -> bool:
        end, now = pilot.finished_s, pilot.plant.time_s
        if burn and pilot.plant.fuel_kg <= 0.0:
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
    facts: Facts,
    pilot: Pilot,
    log: Log,
    *,
    response: dict[str, np.ndarray],
    ground: Ground | None,
) -> Flight:
    """Cut the log and describe the flight."""
    crossings, end = pilot.guidance.crossings, pilot.guidance.finished_s
    assert end is not None  # the flight has ended
    log_hz, rate_hz = pilot.log_hz, scenario.recording.rate_hz
    zero = first_row_s(crossings[0].time_s, log_hz)
    log = log.cut(zero - MARGIN_S - settle_s(scenario), end + MARGIN_S, zero)
    carrier = log.trajectory(facts.cg_b)
    duration = math.floor((end - zero) * rate_hz + 1e-9) / rate_hz
    pilot.flaps.check()
    segments = segments_of(crossings, pilot.path, zero, end, carrier)
    trains = [on_clock(train, zero) for train in pilot.trains]
    check_trains(trains, segments)
    maneuvers, parts = tuple(measure(train, carrier)[0] for train in trains), parts_of(legs_of(scenario))
    return Flight(
        carrier=carrier,
        duration_s=duration,
        simulation_rate_hz=float(scenario.flight.step_hz),
        controls=log.controls(),
        switches=log.switches(),
        wind_n=log.wind(),
        rotors=log.rotors(facts.engine),
        segments=segments,
        maneuvers=maneuvers,
        notes={
            "jsbsim": str(jsbsim.__version__),
            "integrators": integrators_for(facts, scenario.flight.step_hz),
            "step_hz": scenario.flight.step_hz,
            "log_hz": log_hz,
            "warmup_s": warmup_s(scenario),
            "mass_kg": facts.mass_kg,
            "fuel_left_kg": pilot.plant.fuel_kg,
            "loop_response": {name: values.tolist() for name, values in response.items()},
            **pattern_notes(scenario, pilot.path, carrier, segments, trains),
            **amplitude_notes(maneuvers),
            "flap_runs": runs_of(log.time_s, log["flap"]),
            **drape_notes(pilot.planned, zero, segments, carrier, ground=ground, parts=parts),
        },
    )
