"""Response of the autopilot loops to a sine, measured once for an aircraft at a speed, a height and a step rate."""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts
from magsim.errors import DataError, RequestError
from magsim.flight.model.aero import stall_angle
from magsim.flight.model.airframe import model_files
from magsim.flight.model.plant import FlightTroubleError
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.trim import trim
from magsim.flight.path.elements import PathLabel, PathPoint, Straight
from magsim.flight.path.plane import LocalPlane
from magsim.flight.pilot.combined import calibrate_maneuver, drives_from_arrays, drives_to_arrays
from magsim.flight.pilot.log import Log
from magsim.flight.pilot.measure import measure, middle_of, rows_between
from magsim.flight.pilot.nodes import HEIGHTS_M, Arrays, Parts, between_nodes, mean
from magsim.flight.pilot.pilot import Pilot
from magsim.flight.pilot.response import BOUNDS, UNITY, LoopResponse, mixed_responses
from magsim.flight.pilot.trains import ManeuverKey, SineTrain
from magsim.storage import cached
from magsim.trajectory import Trajectory

GRID_PERIODS_S = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Periods at which the loops' response is measured."""


def calibration_trains(axis: str, amplitude_deg: Sequence[float]) -> list[SineTrain]:
    """Return trains of three cycles of each period of the grid on one axis, one after the other."""
    out, time = [], 20.0
    for period, amplitude in zip(GRID_PERIODS_S, amplitude_deg, strict=True):
        half = 0.5 * period
        time += half
        out.append(SineTrain(axis, 1, 1, time, period, 3, amplitude, half, half))
        time += 3.0 * period + half + 10.0
    return out


def calibration_amplitude(axis: str, period_s: float, margin_deg: float) -> float:
    """Return the amplitude [deg] of a calibration train.

    It is ten degrees. In pitch it is no more than 0.8 of the margin to the stall. With short periods, where large
    swings load lift curve and elevator most, it is up to the load factor of fifteen degrees in five seconds, and up to
    1.2 of the margin: the path follows the pitch, so the angle of attack takes two thirds of it.
    """
    if axis != "pitch":
        return 10.0
    if period_s <= 6.0:
        return max(1.0, min(3.0 * period_s, 1.2 * margin_deg))
    return max(1.0, min(10.0, 0.8 * margin_deg))


LOG_HZ = 30


STALL_MARGIN = math.radians(2.0)


FIRST_DEG = 3.0
"""Amplitude of the first calibration flight."""


USED_PART = 0.8
"""Part of the largest amplitude that the second one flies."""


PROPORTIONAL_DEG, PROPORTIONAL_PART = 20.0, 0.5
"""Up to this amplitude, and this part of the largest one, the loops respond in proportion."""


SLOW_PITCH_S = 10.0
"""Slower pitch oscillations change the airspeed and do not respond in proportion either."""


def loop_response(facts: Facts, axes: Sequence[str], setup: PlantSetup) -> LoopResponse:
    """Return the response of the loops on some axes, from the cache if it was measured before.

    Parameters
    ----------
    facts : Facts
    axes : sequence of str
        Which of pitch, roll, yaw.
    setup : PlantSetup
        Speed, height, flaps and step rate of the flight; its wind and its place do not matter. It is measured at the
        nodes around speed and height (``nodes``).

    Raises
    ------
    DataError
        If the aircraft cannot fly the calibration's maneuvers there.
    """
    model, arrays = _model_key(facts), dict[str, np.ndarray]()
    for axis in axes:

        def measured(at: PlantSetup, axis: str = axis) -> Arrays:
            return measure_response(facts, axis, at).arrays()

        own = model | {"axis": axis}
        arrays |= _calibrated("loops", own, facts, _bare(setup), measured=measured, mixed=mixed_responses)
    return LoopResponse.from_arrays(arrays)


def calibrate_maneuvers(
    facts: Facts, setup: PlantSetup, response: LoopResponse, maneuvers: Sequence[ManeuverKey]
) -> LoopResponse:
    """Add the drives of maneuvers with a calibration of their own to a response, from the cache if they are stored.

    Raises
    ------
    RequestError
        If a maneuver cannot be flown as commanded.
    """
    model, drives = _model_key(facts), {}
    for maneuver in maneuvers:

        def measured(at: PlantSetup, maneuver: ManeuverKey = maneuver) -> Arrays:
            def flown(trains: Sequence[SineTrain], response: LoopResponse, stop_s: float) -> Trajectory:
                return _fly(facts, at, trains, response, stop_s).trajectory(facts.cg_b)

            alone = loop_response(facts, [axis.axis for axis in maneuver], at)
            return drives_to_arrays(calibrate_maneuver(maneuver, alone, flown))

        own = model | {"maneuver": maneuver}
        drives[maneuver] = drives_from_arrays(
            _calibrated("maneuvers", own, facts, _bare(setup), measured=measured, mixed=mean)
        )
    return replace(response, maneuvers=drives)


def _calibrated(
    kind: str,
    own: dict[str, object],
    facts: Facts,
    setup: PlantSetup,
    *,
    measured: Callable[[PlantSetup], Arrays],
    mixed: Callable[[Parts], Arrays],
) -> Arrays:
    """Return a calibration at a speed and a height, from the cache where it is there.

    Parameters
    ----------
    kind : str
        Folder of the cache.
    own : dict
        What it depends on beside the setup.
    facts : Facts
    setup : PlantSetup
    measured : callable
        Measures it.
    mixed : callable
        The mean of several.

    Raises
    ------
    DataError, RequestError
        If the aircraft cannot fly it there.
    """

    def stored(at: PlantSetup) -> Arrays:
        def attempt() -> Arrays:
            try:
                return measured(at)
            except (DataError, RequestError):
                return {}

        where = {name: getattr(at, name) for name in ("speed_mps", "alt_m", "step_hz", "flap_rad")}
        return cached(kind, own | where, attempt)

    # measured again, for what is wrong to be raised
    return between_nodes(facts, setup, stored, mixed) or measured(setup)


def _bare(setup: PlantSetup) -> PlantSetup:
    """Return the same speed, height and flaps over the equator in still air."""
    return PlantSetup(
        lat_rad=0.0,
        lon_rad=0.0,
        alt_m=max(setup.alt_m, HEIGHTS_M[0]),
        course=0.0,
        speed_mps=setup.speed_mps,
        step_hz=setup.step_hz,
        flap_rad=setup.flap_rad,
    )


def _model_key(facts: Facts) -> dict[str, object]:
    """Return what every calibration depends on beside speed, height, flaps and step rate."""
    return {"model": _model_digest(facts), "jsbsim": str(jsbsim.__version__)}


@lru_cache(maxsize=8)
def _model_digest(facts: Facts) -> str:
    return hashlib.sha256("\0".join(model_files(facts, "aircraft").values()).encode()).hexdigest()


def measure_response(facts: Facts, axis: str, setup: PlantSetup) -> LoopResponse:
    """Fly trains of every period of the grid in still air, along a line over the equator, and fit them.

    There are two flights. The first has small amplitudes and also shows how much control and angle of attack a degree
    takes. The second is as large as that allows and is commanded by the inverse of the first response, so that the
    guidance works on the same oscillations as in the flight itself. The two responses are multiplied.
    """
    margin = math.degrees(stall_angle(facts) - STALL_MARGIN - trim(facts, setup).pitch)
    wanted = np.array([calibration_amplitude(axis, period, margin) for period in GRID_PERIODS_S])
    response, amplitude = UNITY, np.minimum(wanted, FIRST_DEG)
    for _ in range(2):
        trains = calibration_trains(axis, amplitude.tolist())
        gain, phase, largest, bound = _flown_over_asked(facts, setup, trains, response)
        before = [response.at(axis, train.period_s) for train in trains]
        gain *= np.array([g for g, _ in before])
        phase += np.array([p for _, p in before])
        period = np.array(GRID_PERIODS_S)
        response = LoopResponse(period, {axis: gain}, {axis: phase}, {axis: largest}, {axis: bound})
        amplitude = np.minimum(wanted, USED_PART * largest)
    return response


def _flown_over_asked(
    facts: Facts, setup: PlantSetup, trains: list[SineTrain], response: LoopResponse
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ratio of amplitudes, phase [rad], largest amplitude [deg] and its bound for each train of a flight."""
    stop_s = trains[-1].stop_s + trains[-1].ease_out_s + 1.0
    try:
        log = _fly(facts, setup, trains, response, stop_s)
    except FlightTroubleError as error:
        msg = (
            f"the {trains[0].axis} loop could not be calibrated at {setup.speed_mps:g} m/s and {setup.alt_m:g} m: "
            f"{error}"
        )
        raise DataError(msg) from None
    carrier = log.trajectory(facts.cg_b)
    measured = [measure(train, carrier) for train in trains]
    reached = [_reach(facts, log, train, flown.flown_deg) for train, (flown, _) in zip(trains, measured, strict=True)]
    return (
        np.array([flown.flown_deg / flown.asked_deg for flown, _ in measured]),
        np.array([phase for _, phase in measured]),
        np.array([largest for largest, _ in reached]),
        np.array([float(bound) for _, bound in reached]),
    )


def _reach(facts: Facts, log: Log, train: SineTrain, flown_deg: float) -> tuple[float, int]:
    """Return the amplitude [deg] at which, in proportion, a control or the air reaches its limit, and which one."""
    rows = rows_between(log.time_s, *middle_of(train))
    controls, limits = facts.controls, facts.limits
    ranges = {
        "elevator": controls.elevator.travel.value,
        "aileron": controls.aileron.travel.value,
        "rudder": controls.rudder.travel.value,
        "alpha": (math.radians(limits.angle_of_attack.value[0]), stall_angle(facts)),
        "beta": (-math.radians(limits.sideslip.value), math.radians(limits.sideslip.value)),
    }
    out = []
    for number, name in enumerate(BOUNDS):
        values = log[name][rows]
        middle, half = 0.5 * float(values.max() + values.min()), 0.5 * float(np.ptp(values))
        room = max(0.0, min(ranges[name][1] - middle, middle - ranges[name][0]))
        out.append((flown_deg * room / max(half, 1e-9), number))
    largest, number = min(out)
    return max(largest, 1e-3), number


def maneuvers_to_calibrate(trains: Sequence[SineTrain], response: LoopResponse) -> tuple[ManeuverKey, ...]:
    """Select the maneuvers that need their own calibration, each once: combined ones and those near the limits."""
    return tuple(
        dict.fromkeys(
            train.maneuver
            for train in trains
            if len(train.maneuver) > 1
            or train.amplitude_deg > PROPORTIONAL_DEG
            or (train.axis == "pitch" and train.period_s > SLOW_PITCH_S)
            or train.amplitude_deg > PROPORTIONAL_PART * response.largest_at(train.axis, train.period_s)[0]
        )
    )


def check_reach(trains: Sequence[SineTrain], response: LoopResponse, facts: Facts, setup: PlantSetup) -> None:
    """Refuse maneuvers that need more than controls and lift can give.

    Raises
    ------
    RequestError
        With the amplitude that is allowed in that period, and the period in which the amplitude is.
    """
    flown = dict.fromkeys((train, cycle) for train in trains for cycle in train.curve.cycles)
    for train, (amplitude_deg, period_s) in flown:
        largest, bound = response.largest_at(train.axis, period_s)
        if amplitude_deg <= largest:
            continue
        nearest_s = response.nearest_s(train.axis, amplitude_deg, period_s)
        other = "" if nearest_s is None else f", or a period of {nearest_s:g} s"
        why = {"alpha": "goes beyond the stall", "beta": "goes beyond the sideslip of the flight model"}
        msg = (
            f"pattern.maneuvers: {amplitude_deg:.4g} deg of {train.axis} in {period_s:.4g} s (leg {train.leg} "
            f"of circuit {train.circuit}) {why.get(bound, f'needs more {bound} than available')} at "
            f"{setup.speed_mps:g} m/s and {setup.alt_m:g} m; allowed for {facts.title}: up to "
            f"{math.floor(10.0 * largest) / 10.0:g} deg in that period{other}"
        )
        raise RequestError(msg)


def _fly(facts: Facts, setup: PlantSetup, trains: Sequence[SineTrain], response: LoopResponse, stop_s: float) -> Log:
    """Fly trains along a line over the equator."""
    line = Straight(PathLabel(1, 1, False, 0.0), PathPoint(0.0, 0.0, 0.0, 0.0), 1.0e7)
    plane = LocalPlane(0.0, 0.0, setup.alt_m)
    pilot = Pilot(
        facts,
        setup,
        plane=plane,
        path=(line,),
        along_m=0.0,
        log_hz=LOG_HZ,
        response=(response,),
        trains=trains,
    )
    return pilot.fly(lambda p: p.plant.time_s >= stop_s)
