"""What the loops make of a sine, measured once for an aircraft at a speed, a height and a step rate."""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import replace

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts
from magsim.errors import DataError, RequestError
from magsim.flight.model.aero import stall_angle
from magsim.flight.model.airframe import model_files
from magsim.flight.model.plant import FlightTroubleError
from magsim.flight.model.setup import Setup
from magsim.flight.model.trim import trim
from magsim.flight.path.elements import Label, Place, Straight
from magsim.flight.path.plane import LocalPlane
from magsim.flight.pilot.combined import close_joint, drives_from_arrays, drives_to_arrays
from magsim.flight.pilot.log import Log
from magsim.flight.pilot.measure import measure, middle_of
from magsim.flight.pilot.pilot import Pilot
from magsim.flight.pilot.response import BOUNDS, UNITY, LoopResponse
from magsim.flight.pilot.trains import Joint, Sweep
from magsim.storage import cached
from magsim.trajectory import Trajectory

GRID_PERIODS_S = (3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0)
"""Periods at which the loops' response is measured."""


def calibration_sweeps(axis: str, amplitude_deg: Sequence[float]) -> list[Sweep]:
    """Trains of three cycles of each period of the grid on one axis, one after the other."""
    out, time = [], 20.0
    for period, amplitude in zip(GRID_PERIODS_S, amplitude_deg, strict=True):
        half = 0.5 * period
        time += half
        out.append(Sweep(axis, 1, 1, time, period, 3, amplitude, half, half))
        time += 3.0 * period + half + 10.0
    return out


def calibration_amplitude(axis: str, period_s: float, margin_deg: float) -> float:
    """Amplitude [deg] of a calibration train.

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
"""Up to this amplitude, and this part of the largest one, the loops answer in proportion."""


SLOW_PITCH_S = 10.0
"""Slower pitch swings take the airspeed with them, and do not answer in proportion either."""


LOWEST_M = 500.0
"""Lower flights are calibrated here, clear of the ground; the density differs by a twentieth at most."""


def loop_response(facts: Facts, axes: Sequence[str], setup: Setup) -> LoopResponse:
    """Response of the loops on some axes, from the cache where it has been measured before.

    Parameters
    ----------
    facts : Facts
    axes : sequence of str
        Which of pitch, roll, yaw.
    setup : Setup
        Speed, height, flaps and step rate of the flight; its wind and its place do not matter.

    Raises
    ------
    DataError
        If the aircraft cannot fly the calibration's maneuvers there.
    """
    setup = _bare(setup)
    common, arrays = _key(facts, setup), {}
    for axis in axes:

        def make(axis: str = axis) -> dict[str, np.ndarray]:
            return measure_response(facts, axis, setup).arrays()

        arrays |= cached("loops", common | {"axis": axis}, make)
    return LoopResponse.from_arrays(arrays)


def close_joints(facts: Facts, setup: Setup, response: LoopResponse, joints: Sequence[Joint]) -> LoopResponse:
    """The same response with what the generators are told in some maneuvers, from the cache if it is there.

    Raises
    ------
    RequestError
        If a maneuver cannot be flown as it was asked.
    """
    setup = _bare(setup)
    common = _key(facts, setup)

    def flown(sweeps: Sequence[Sweep], response: LoopResponse, stop_s: float) -> Trajectory:
        return _fly(facts, setup, sweeps, response, stop_s).trajectory(facts.cg_b)

    closed = {}
    for joint in joints:

        def close(joint: Joint = joint) -> dict[str, np.ndarray]:
            return drives_to_arrays(close_joint(joint, response, flown))

        closed[joint] = drives_from_arrays(cached("joints", common | {"joint": joint}, close))
    return replace(response, joints=closed)


def _bare(setup: Setup) -> Setup:
    """The same speed, height and flaps over the equator in still air."""
    return Setup(
        lat_rad=0.0,
        lon_rad=0.0,
        alt_m=max(setup.alt_m, LOWEST_M),
        course=0.0,
        speed_mps=setup.speed_mps,
        step_hz=setup.step_hz,
        flap_rad=setup.flap_rad,
    )


def _key(facts: Facts, setup: Setup) -> dict[str, object]:
    """What every calibration depends on."""
    return {
        "model": hashlib.sha256("\0".join(model_files(facts, "aircraft").values()).encode()).hexdigest(),
        "jsbsim": str(jsbsim.__version__),
        "speed_mps": setup.speed_mps,
        "alt_m": setup.alt_m,
        "step_hz": setup.step_hz,
        "flap_rad": setup.flap_rad,
    }


def measure_response(facts: Facts, axis: str, setup: Setup) -> LoopResponse:
    """Fly trains of every period of the grid in still air, along a line over the equator, and fit them.

    Twice: small first, which also shows how much of controls and air a degree takes; then as large as that allows,
    asked for the inverse of what the first flight showed, so that the guidance meets the swings that it will meet
    later. What the second flight finds is multiplied to the first.
    """
    margin = math.degrees(stall_angle(facts) - STALL_MARGIN - trim(facts, setup).pitch)
    wanted = np.array([calibration_amplitude(axis, period, margin) for period in GRID_PERIODS_S])
    response, amplitude = UNITY, np.minimum(wanted, FIRST_DEG)
    for _ in range(2):
        sweeps = calibration_sweeps(axis, amplitude.tolist())
        gain, phase, largest, bound = _flown_over_asked(facts, setup, sweeps, response)
        before = [response.at(axis, sweep.period_s) for sweep in sweeps]
        gain *= np.array([g for g, _ in before])
        phase += np.array([p for _, p in before])
        period = np.array(GRID_PERIODS_S)
        response = LoopResponse(period, {axis: gain}, {axis: phase}, {axis: largest}, {axis: bound})
        amplitude = np.minimum(wanted, USED_PART * largest)
    return response


def _flown_over_asked(
    facts: Facts, setup: Setup, sweeps: list[Sweep], response: LoopResponse
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Ratio of amplitudes, phase [rad], largest amplitude [deg] and its bound for each train of a flight."""
    stop_s = sweeps[-1].stop_s + sweeps[-1].ease_out_s + 1.0
    try:
        log = _fly(facts, setup, sweeps, response, stop_s)
    except FlightTroubleError as error:
        msg = (
            f"the {sweeps[0].axis} loop could not be calibrated at {setup.speed_mps:g} m/s and {setup.alt_m:g} m: "
            f"{error}"
        )
        raise DataError(msg) from None
    carrier = log.trajectory(facts.cg_b)
    measured = [measure(sweep, carrier) for sweep in sweeps]
    reached = [_reach(facts, log, sweep, flown.flown_deg) for sweep, (flown, _) in zip(sweeps, measured, strict=True)]
    return (
        np.array([flown.flown_deg / flown.asked_deg for flown, _ in measured]),
        np.array([phase for _, phase in measured]),
        np.array([largest for largest, _ in reached]),
        np.array([float(bound) for _, bound in reached]),
    )


def _reach(facts: Facts, log: Log, sweep: Sweep, flown_deg: float) -> tuple[float, int]:
    """Amplitude [deg] at which a control reaches its stop, or the air its limit, all in proportion; and which."""
    low, high = middle_of(sweep)
    rows = (log.time_s >= low - 1e-9) & (log.time_s <= high + 1e-9)
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


def own_calibration(sweeps: Sequence[Sweep], response: LoopResponse) -> tuple[Joint, ...]:
    """Maneuvers that need a calibration of their own, each once: combined ones, and swings near what can be flown."""
    return tuple(
        dict.fromkeys(
            sweep.joint
            for sweep in sweeps
            if len(sweep.joint) > 1
            or sweep.amplitude_deg > PROPORTIONAL_DEG
            or (sweep.axis == "pitch" and sweep.period_s > SLOW_PITCH_S)
            or sweep.amplitude_deg > PROPORTIONAL_PART * response.largest_at(sweep.axis, sweep.period_s)[0]
        )
    )


def check_reach(sweeps: Sequence[Sweep], response: LoopResponse, facts: Facts, setup: Setup) -> None:
    """Refuse maneuvers that would need more than controls and lift can give.

    Raises
    ------
    RequestError
        With the amplitude that is allowed in that period, and the period in which the amplitude is.
    """
    for sweep in sweeps:
        largest, bound = response.largest_at(sweep.axis, sweep.period_s)
        if sweep.amplitude_deg <= largest:
            continue
        period_s = response.nearest_s(sweep.axis, sweep.amplitude_deg, sweep.period_s)
        other = "" if period_s is None else f", or a period of {period_s:g} s"
        why = {"alpha": "goes beyond the stall", "beta": "goes beyond the sideslip of the flight model"}
        msg = (
            f"pattern.maneuvers: {sweep.amplitude_deg:g} deg of {sweep.axis} in {sweep.period_s:g} s (leg {sweep.leg} "
            f"of circuit {sweep.circuit}) {why.get(bound, f'needs more {bound} than there is')} at "
            f"{setup.speed_mps:g} m/s and {setup.alt_m:g} m; allowed for {facts.title}: up to "
            f"{math.floor(10.0 * largest) / 10.0:g} deg in that period{other}"
        )
        raise RequestError(msg)


def _fly(facts: Facts, setup: Setup, sweeps: Sequence[Sweep], response: LoopResponse, stop_s: float) -> Log:
    """Fly trains along a line over the equator."""
    line = Straight(Label(1, 1, False, 0.0), Place(0.0, 0.0, 0.0, 0.0), 1.0e7)
    plane = LocalPlane(0.0, 0.0, setup.alt_m)
    pilot = Pilot(
        facts,
        setup,
        plane=plane,
        path=(line,),
        along_m=0.0,
        log_hz=LOG_HZ,
        response=(response,),
        sweeps=sweeps,
    )
    return pilot.fly(lambda p: p.plant.time_s >= stop_s)
