"""From the scenario's tow and the bird's file to a line, and whether it can be flown."""

import math

import numpy as np
from scipy.optimize import brentq

from magsim.aircraft import Aircraft, Bird
from magsim.earth.atmosphere import standard_density
from magsim.errors import RequestError
from magsim.flight.tow.coupled import Coupled
from magsim.flight.tow.hook import EARTH_SPIN_E
from magsim.flight.tow.line import Body, Line, Rope
from magsim.flight.tow.steady import Steady, steady
from magsim.scenario import Scenario, Tow

MOST_TRAIL = math.radians(70.0)
"""Angle from the vertical beyond which a line is no line under a carrier any more."""

HEAVIEST_KG = 2000.0


def line_of(tow: Tow, bird: Bird, mass_kg: float | None = None) -> Line:
    """The line of a scenario: what it leaves out is what the bird's file says.

    Parameters
    ----------
    tow : Tow
    bird : Bird
    mass_kg : float, optional
        Of the body, instead of both.
    """
    facts = bird.facts
    body, fins, rope, asked = facts.body, facts.fins, facts.rope, tow.body
    mass = mass_kg or asked.mass_kg or body.mass.value
    cg = body.center_of_gravity.value
    bridle = asked.bridle_m or body.bridle.value
    station = fins.station.value if asked.fin_station_m is None else asked.fin_station_m
    drag = body.drag_area.value if asked.drag_area_m2 is None else asked.drag_area_m2
    return Line(
        Rope(
            length_m=tow.rope.length_m or rope.length.value,
            diameter_m=tow.rope.diameter_m or rope.diameter.value,
            mass_per_m=tow.rope.mass_kgpm or rope.mass_per_length.value,
            normal_drag=rope.normal_drag.value,
            tangential_drag=rope.tangential_drag.value,
        ),
        Body(
            mass_kg=mass,
            inertia_kgm2=tuple(value * mass / body.mass.value for value in body.inertia.value),
            bridle_m=tuple(at - center for at, center in zip(bridle, cg, strict=True)),
            drag_area_m2=(drag, 0.0, 0.0),
            cross_area_m2=body.cross_area.value if asked.cross_area_m2 is None else asked.cross_area_m2,
            fin_area_m2=fins.area.value if asked.fin_area_m2 is None else asked.fin_area_m2,
            fin_slope=fins.lift_slope.value,
            fin_station_m=station - cg[0],
            fin_radius_m=fins.radius.value,
            munk_m3=body.munk_factor.value * body.volume.value,
        ),
        tow.rope.links,
        EARTH_SPIN_E,
    )


def hook_of(tow: Tow, aircraft: Aircraft) -> tuple[float, float, float]:
    """Where the rope is tied, (3,) [m] carrier axes from its datum."""
    hook = tow.hook_m or aircraft.facts.hook_b
    assert hook is not None  # the scenario was checked against its aircraft
    return hook


def coupled_line(
    scenario: Scenario, aircraft: Aircraft, bird: Bird, *, step_hz: int, log_hz: int, alt_m: float
) -> Coupled | None:
    """The line that pulls on the carrier of a scenario; None where it does not."""
    tow, speed = scenario.tow, scenario.start.speed_mps
    if tow is None or tow.coupling == "one_way":
        return None
    arm_b = np.array(hook_of(tow, aircraft)) - np.array(aircraft.facts.cg_b)
    return Coupled(
        line_of(tow, bird),
        equilibrium(tow, bird, speed, float(standard_density(alt_m))),
        arm_b,
        gusts=tow.gusts,
        airspeed_mps=speed,
        seed=scenario.seed,
        step_s=1.0 / step_hz,
        steps_per_row=step_hz // log_hz,
    )


def hangs(found: Steady | None) -> bool:
    """Whether an equilibrium is that of a line under a carrier."""
    return found is not None and found.upright and found.trail <= MOST_TRAIL


def equilibrium(tow: Tow, bird: Bird, speed_mps: float, density: float) -> Steady:
    """The equilibrium of a scenario's line.

    Parameters
    ----------
    tow : Tow
    bird : Bird
    speed_mps : float
        Through the air.
    density : float [kg/m^3]

    Raises
    ------
    RequestError
        If the bird is too light for its drag, or finds no pitch in which it is at rest.
    """
    line = line_of(tow, bird)
    found = steady(line, speed_mps, density)
    if found is not None and hangs(found):
        return found
    if found is None:
        msg = (
            f"tow.body: {bird.name} finds no pitch in which it hangs at rest at {speed_mps:.4g} m/s; allowed: larger "
            "fins farther behind the bridle (fin_area_m2, fin_station_m), or another bridle_m"
        )
        raise RequestError(msg)
    what = "lifts off" if not found.upright else f"trails {math.degrees(found.trail):.0f} deg behind the hook"
    msg = (
        f"tow.body.mass_kg: {line.body.mass_kg:g} kg are too light for their drag and that of the rope: at "
        f"{speed_mps:.4g} m/s the bird {what}; allowed: up to {math.degrees(MOST_TRAIL):.0f} deg, that is "
        f"{_least_mass(tow, bird, speed_mps, density)}, or up to {_most_speed(line, speed_mps, density):.1f} m/s"
    )
    raise RequestError(msg)


def _least_mass(tow: Tow, bird: Bird, speed_mps: float, density: float) -> str:
    """The mass from which on a bird hangs, in words."""

    def over(mass: float) -> float:
        found = steady(line_of(tow, bird, mass), speed_mps, density)
        return -1.0 if found is None or not found.upright else MOST_TRAIL - found.trail

    light = line_of(tow, bird).body.mass_kg
    if over(HEAVIEST_KG) <= 0.0:
        return "a shorter or thinner rope"
    return f"at least {math.ceil(10.0 * brentq(over, light, HEAVIEST_KG, xtol=0.01)) / 10.0:g} kg"


def _most_speed(line: Line, speed_mps: float, density: float) -> float:
    """The speed up to which a line hangs [m/s], rounded down to a tenth."""

    def over(speed: float) -> float:
        found = steady(line, speed, density)
        return -1.0 if found is None or not found.upright else MOST_TRAIL - found.trail

    return math.floor(10.0 * brentq(over, 0.1, speed_mps, xtol=0.01)) / 10.0
