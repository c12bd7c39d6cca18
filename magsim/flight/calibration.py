"""What the loops make of a sine, measured once for an aircraft at a speed, a height and a step rate."""

import hashlib
import math

import jsbsim
import numpy as np

from magsim.aircraft.facts import Facts
from magsim.errors import DataError
from magsim.flight.aero import stall_angle
from magsim.flight.elements import Label, Place, Straight
from magsim.flight.maneuvers import GRID_PERIODS_S, UNITY, LoopResponse, Sweep, calibration_sweeps, measure
from magsim.flight.model import model_files
from magsim.flight.patterns import LocalPlane
from magsim.flight.pilot import Pilot
from magsim.flight.plant import FlightTroubleError, Setup, trim
from magsim.storage import cached

LOG_HZ = 30
STALL_MARGIN = math.radians(2.0)
LOWEST_M = 500.0
"""Lower flights are calibrated here, clear of the ground; the density differs by a twentieth at most."""


def loop_response(facts: Facts, axes: tuple[str, ...], setup: Setup) -> LoopResponse:
    """Response of the loops on some axes, from the cache where it has been measured before.

    Parameters
    ----------
    facts : Facts
    axes : tuple of str
        Which of pitch, roll, yaw.
    setup : Setup
        Speed, height, flaps and step rate of the flight; its wind and its place do not matter.

    Raises
    ------
    DataError
        If the aircraft cannot fly the calibration's maneuvers there.
    """
    model = hashlib.sha256("\0".join(model_files(facts, "aircraft").values()).encode()).hexdigest()
    arrays: dict[str, np.ndarray] = {}
    setup = Setup(
        lat_rad=0.0,
        lon_rad=0.0,
        alt_m=max(setup.alt_m, LOWEST_M),
        course=0.0,
        speed_mps=setup.speed_mps,
        step_hz=setup.step_hz,
        flap_rad=setup.flap_rad,
    )
    for axis in axes:
        key = {
            "model": model,
            "jsbsim": str(jsbsim.__version__),
            "axis": axis,
            "speed_mps": setup.speed_mps,
            "alt_m": setup.alt_m,
            "step_hz": setup.step_hz,
            "flap_rad": setup.flap_rad,
            "method": 3,
        }

        def make(axis: str = axis) -> dict[str, np.ndarray]:
            return measure_response(facts, axis, setup).arrays()

        arrays |= cached("loops", key, make)
    return LoopResponse.from_arrays(arrays)


def measure_response(facts: Facts, axis: str, setup: Setup) -> LoopResponse:
    """Fly trains of every period of the grid in still air, along a line over the equator, and fit them.

    Twice: the second flight is asked for the inverse of what the first one showed, so that the guidance meets the
    swings that it will meet later; what it finds is multiplied to the first.
    """
    margin = stall_angle(facts) - STALL_MARGIN - trim(facts, setup).pitch
    sweeps = calibration_sweeps(axis, math.degrees(margin))
    response = UNITY
    for _ in range(2):
        gain, phase = _flown_over_asked(facts, setup, sweeps, response)
        before = [response.at(axis, sweep.period_s) for sweep in sweeps]
        gain *= np.array([g for g, _ in before])
        phase += np.array([p for _, p in before])
        response = LoopResponse(np.array(GRID_PERIODS_S), {axis: gain}, {axis: phase})
    return response


def _flown_over_asked(
    facts: Facts, setup: Setup, sweeps: list[Sweep], response: LoopResponse
) -> tuple[np.ndarray, np.ndarray]:
    """Ratio of amplitudes and phase [rad] of each train of a calibration flight."""
    line = Straight(Label(1, 1, False, 0.0), Place(0.0, 0.0, 0.0, 0.0), 1.0e7)
    stop_s = sweeps[-1].stop_s + sweeps[-1].ease_out_s + 1.0
    plane = LocalPlane(0.0, 0.0, setup.alt_m)
    pilot = Pilot(
        facts,
        setup,
        plane=plane,
        path=(line,),
        along_m=0.0,
        log_hz=LOG_HZ,
        response=response,
        sweeps=sweeps,
    )
    try:
        log = pilot.fly(lambda p: p.plant.time_s >= stop_s)
    except FlightTroubleError as error:
        msg = (
            f"the {sweeps[0].axis} loop could not be calibrated at {setup.speed_mps:g} m/s and {setup.alt_m:g} m: "
            f"{error}"
        )
        raise DataError(msg) from None
    carrier = log.trajectory(facts.cg_b)
    measured = [measure(sweep, carrier) for sweep in sweeps]
    return (
        np.array([flown.flown_deg / flown.asked_deg for flown, _ in measured]),
        np.array([phase for _, phase in measured]),
    )
