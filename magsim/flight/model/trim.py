"""Straight and level flight by JSBSim's full trim."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import jsbsim

from magsim.aircraft.engine import TurbopropEngine
from magsim.aircraft.facts import Facts
from magsim.errors import RequestError
from magsim.flight.model.aero import flap_lift
from magsim.flight.model.engines import lever_of
from magsim.flight.model.instance import load
from magsim.flight.model.setup import PlantSetup
from magsim.units import FT, LBF, SLUG_FT3


@dataclass(frozen=True)
class Trim:
    """Straight and level flight."""

    pitch: float
    roll: float
    commands: Mapping[str, float]


def trimmed_twin(facts: Facts, setup: PlantSetup) -> jsbsim.FGFDMExec:
    """Return the twin with direct thrust, trimmed for straight and level flight in still air by JSBSim's full trim.

    Raises
    ------
    RequestError
        If the aircraft cannot fly like that.
    """
    fdm = load(facts, setup.step_hz, twin=True)
    set_initial_place(fdm, setup)
    fdm["ic/psi-true-deg"] = math.degrees(setup.course)
    fdm["ic/gamma-deg"] = 0.0
    fdm["ic/vt-fps"] = setup.speed_mps / FT
    fdm["propulsion/fuel_freeze"] = 1.0
    fdm.run_ic()
    set_flaps(fdm, facts, setup.flap_rad)
    fdm["propulsion/set-running"] = -1
    try:
        fdm.do_trim(1)
    except jsbsim.TrimFailureError:
        msg = (
            f"start.speed_mps: {facts.title} finds no straight and level flight at {setup.speed_mps:g} m/s "
            f"and {setup.alt_m:g} m; allowed: a speed above the stall and below full power at that height"
        )
        raise RequestError(msg) from None
    return fdm


def trim(facts: Facts, setup: PlantSetup) -> Trim:
    """Return attitude and commands of straight and level flight; raise as ``trimmed_twin`` does."""
    fdm = trimmed_twin(facts, setup)
    names = (
        "fcs/throttle-cmd-norm",
        "fcs/pitch-trim-cmd-norm",
        "fcs/elevator-cmd-norm",
        "fcs/aileron-cmd-norm",
        "fcs/roll-trim-cmd-norm",
        "fcs/rudder-cmd-norm",
        "fcs/yaw-trim-cmd-norm",
    )
    commands = {name: fdm[name] for name in names}
    if isinstance(facts.engine, TurbopropEngine):
        # The twin's lever is a part of the thrust, the turbine's one of the power.
        thrust, density = fdm["propulsion/engine/thrust-lbs"] * LBF, fdm["atmosphere/rho-slugs_ft3"] * SLUG_FT3
        commands["fcs/throttle-cmd-norm"] = lever_of(facts.engine, thrust, setup.speed_mps, density)
    return Trim(fdm["attitude/theta-rad"], fdm["attitude/phi-rad"], commands)


def set_initial_place(fdm: jsbsim.FGFDMExec, setup: PlantSetup) -> None:
    """Set the initial place and the ground below it."""
    fdm["ic/terrain-elevation-ft"] = setup.ground_m / FT
    fdm["ic/lat-geod-deg"] = math.degrees(setup.lat_rad)
    fdm["ic/long-gc-deg"] = math.degrees(setup.lon_rad)
    fdm["ic/h-sl-ft"] = setup.alt_m / FT


def set_flaps(fdm: jsbsim.FGFDMExec, facts: Facts, flap_rad: float) -> None:
    """Set the flaps at rest at a deflection, with their lift a part of the trim."""
    fdm["fcs/flap-pos-rad"] = flap_rad
    fdm["ap/flap-rad"] = flap_rad
    fdm["ap/flap-lift-norm"] = flap_lift(facts, flap_rad)
