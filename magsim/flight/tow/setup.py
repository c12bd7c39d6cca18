"""From the scenario's tow and the bird's file to a line, and whether it can be flown."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from magsim.aircraft import Aircraft, Bird
from magsim.earth.atmosphere import standard_density
from magsim.errors import RequestError
from magsim.flight.tow.chain import Body, Line, Rope
from magsim.flight.tow.coupled import Coupled
from magsim.flight.tow.equilibrium import Steady, steady
from magsim.flight.tow.hook import EARTH_SPIN_E
from magsim.flight.tow.modes import modes
from magsim.scenario import Scenario, Tow

MOST_TRAIL = math.radians(70.0)
"""Angle from the vertical beyond which a line is no line under a carrier any more."""

HEAVIEST_KG, LONGEST_M = 2000.0, 100.0
"""Where allowed masses and ropes are looked for."""

MOST_GROWTH_PS = 2e-3
"""Growth of a swing that no flight is long enough to see [1/s]."""


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
    cg = facts.cg_t
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
        If the bird is too light for its drag, finds no pitch in which it is at rest, or swings up by itself.
    """
    line = line_of(tow, bird)
    found = steady(line, speed_mps, density)
    if found is not None and hangs(found):
        _check_growth(line, found, speed_mps, density)
        return found
    if found is None:
        msg = (
            f"tow.body: {bird.name} finds no pitch in which it hangs at rest at {speed_mps:.4g} m/s; allowed: larger "
            "fins farther behind the bridle (fin_area_m2, fin_station_m), or another bridle_m"
        )
        raise RequestError(msg)
    what = "lifts off" if not found.upright else f"trails {math.degrees(found.trail):.0f} deg behind the hook"
    ways = (
        _heavier(tow, bird, speed_mps, density),
        _slower(line, bird, speed_mps, density),
        "a shorter or thinner rope",
    )
    msg = (
        f"tow.body.mass_kg: {line.body.mass_kg:g} kg are too light for their drag and that of the rope: at "
        f"{speed_mps:.4g} m/s the bird {what}; allowed: up to {math.degrees(MOST_TRAIL):.0f} deg, that is "
        f"{', or '.join(way for way in ways if way)}"
    )
    raise RequestError(msg)


def _check_growth(line: Line, found: Steady, speed_mps: float, density: float) -> None:
    """Refuse a line that swings up without a gust."""
    worst = modes(line, found, speed_mps, density)[0]
    if worst.growth_ps <= MOST_GROWTH_PS:
        return
    how = f"swings up at {worst.frequency_hz:.2f} Hz" if worst.frequency_hz else "turns over"
    msg = (
        f"tow.rope: at {speed_mps:.4g} m/s the bird {how} by itself, e-fold in {1.0 / worst.growth_ps:.1f} s; allowed: "
        f"{_steady_rope(line, speed_mps, density)}larger fins farther behind (tow.body.fin_area_m2, fin_station_m), or "
        "another speed"
    )
    raise RequestError(msg)


def _steady_rope(line: Line, speed_mps: float, density: float) -> str:
    """The rope from which on a bird does not swing up by itself, in words; nothing if no rope helps."""
    length = line.rope.length_m
    while length < LONGEST_M:
        length *= 1.05
        longer = replace(line, rope=replace(line.rope, length_m=length))
        if _flies(longer, speed_mps, density, most_ps=0.0):
            return f"a rope of at least {math.ceil(10.0 * length) / 10.0:g} m, "
    return ""


def _flies(line: Line, speed_mps: float, density: float, most_ps: float = MOST_GROWTH_PS) -> bool:
    """Whether a line hangs under a carrier and does not swing up by itself."""
    found = steady(line, speed_mps, density)
    if found is None or not hangs(found):
        return False
    return modes(line, found, speed_mps, density)[0].growth_ps <= most_ps


def _heavier(tow: Tow, bird: Bird, speed_mps: float, density: float) -> str:
    """The mass from which on a bird can be towed, in words; nothing where there is none."""
    light = line_of(tow, bird).body.mass_kg
    masses = np.geomspace(light, HEAVIEST_KG, 40)
    least = _edge(lambda mass: _flies(line_of(tow, bird, mass), speed_mps, density), masses)
    return "" if least is None else f"at least {math.ceil(10.0 * least) / 10.0:g} kg"


def _slower(line: Line, bird: Bird, speed_mps: float, density: float) -> str:
    """The speed up to which a line can be towed, in words; nothing where the bird's model knows none."""
    speeds = np.linspace(speed_mps, min(speed_mps, bird.facts.limits.speed_mps[0]), 40)
    most = _edge(lambda speed: _flies(line, speed, density), speeds)
    return "" if most is None else f"up to {math.floor(10.0 * most) / 10.0:.1f} m/s"


def _edge(holds: Callable[[float], bool], values: np.ndarray) -> float | None:
    """Where something first holds on the way along some values, the first of which does not; None if nowhere."""
    good = next((k for k in range(1, len(values)) if holds(values[k])), None)
    if good is None:
        return None
    low, high = float(values[good - 1]), float(values[good])
    while abs(high - low) > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
