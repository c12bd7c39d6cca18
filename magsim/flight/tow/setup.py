"""From the scenario's tow and the bird's file to a chain, and whether it can be flown."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from magsim.aircraft import Aircraft, Bird
from magsim.earth.atmosphere import standard_density
from magsim.errors import RequestError
from magsim.flight.tow.chain import Chain, Rope, TowedBody
from magsim.flight.tow.coupled import CoupledChain
from magsim.flight.tow.equilibrium import Equilibrium, find_equilibrium
from magsim.flight.tow.hook import EARTH_SPIN_E
from magsim.flight.tow.modes import modes
from magsim.scenario import Scenario, Tow

MOST_TRAIL = math.radians(70.0)
"""Largest angle of the chain from the vertical under a carrier."""

HEAVIEST_KG, LONGEST_M = 2000.0, 100.0
"""Upper ends of the search for allowed masses and ropes."""

MOST_GROWTH_PS = 2e-3
"""Growth of a mode that is negligible over a flight [1/s]."""


def chain_of(tow: Tow, bird: Bird, mass_kg: float | None = None) -> Chain:
    """Build the chain of a scenario, with the values of the bird's file where it sets none.

    Parameters
    ----------
    tow : Tow
    bird : Bird
    mass_kg : float, optional
        Of the body, replaces the value of scenario and bird.
    """
    facts = bird.facts
    body, fins, rope, given = facts.body, facts.fins, facts.rope, tow.body
    mass = mass_kg or given.mass_kg or body.mass.value
    cg = facts.cg_t
    bridle = given.bridle_m or body.bridle.value
    station = fins.station.value if given.fin_station_m is None else given.fin_station_m
    drag = body.drag_area.value if given.drag_area_m2 is None else given.drag_area_m2
    return Chain(
        Rope(
            length_m=tow.rope.length_m or rope.length.value,
            diameter_m=tow.rope.diameter_m or rope.diameter.value,
            mass_per_m=tow.rope.mass_kgpm or rope.mass_per_length.value,
            normal_drag=rope.normal_drag.value,
            tangential_drag=rope.tangential_drag.value,
        ),
        TowedBody(
            mass_kg=mass,
            inertia_kgm2=tuple(value * mass / body.mass.value for value in body.inertia.value),
            bridle_m=tuple(at - center for at, center in zip(bridle, cg, strict=True)),
            drag_area_m2=(drag, 0.0, 0.0),
            cross_area_m2=body.cross_area.value if given.cross_area_m2 is None else given.cross_area_m2,
            fin_area_m2=fins.area.value if given.fin_area_m2 is None else given.fin_area_m2,
            fin_slope=fins.lift_slope.value,
            fin_station_m=station - cg[0],
            fin_radius_m=fins.radius.value,
            munk_m3=body.munk_factor.value * body.volume.value,
        ),
        tow.rope.links,
        EARTH_SPIN_E,
    )


def hook_of(tow: Tow, aircraft: Aircraft) -> tuple[float, float, float]:
    """Return the position of the hook, (3,) [m] carrier axes from its datum."""
    hook = tow.hook_m or aircraft.facts.hook_b
    assert hook is not None  # the scenario was checked against its aircraft
    return hook


def coupled_chain(
    scenario: Scenario, aircraft: Aircraft, bird: Bird, *, step_hz: int, log_hz: int, alt_m: float
) -> CoupledChain | None:
    """Build the chain that pulls on the carrier of a scenario; None for one-way coupling."""
    tow, speed = scenario.tow, scenario.start.speed_mps
    if tow is None or tow.coupling == "one_way":
        return None
    arm_b = np.array(hook_of(tow, aircraft)) - np.array(aircraft.facts.cg_b)
    return CoupledChain(
        chain_of(tow, bird),
        require_equilibrium(tow, bird, speed, float(standard_density(alt_m))),
        arm_b,
        gusts=tow.gusts,
        airspeed_mps=speed,
        seed=scenario.seed,
        step_s=1.0 / step_hz,
        steps_per_row=step_hz // log_hz,
    )


def hangs(equilibrium: Equilibrium | None) -> bool:
    """Whether an equilibrium exists and hangs under a carrier."""
    return equilibrium is not None and equilibrium.upright and equilibrium.trail <= MOST_TRAIL


def require_equilibrium(tow: Tow, bird: Bird, speed_mps: float, density: float) -> Equilibrium:
    """Return the equilibrium of a scenario's chain, if it can be flown.

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
        If the bird is too light for its drag, has no pitch of equilibrium, or is unstable.
    """
    chain = chain_of(tow, bird)
    equilibrium = find_equilibrium(chain, speed_mps, density)
    if equilibrium is not None and hangs(equilibrium):
        _check_growth(chain, equilibrium, speed_mps, density)
        return equilibrium
    if equilibrium is None:
        msg = (
            f"tow.body: {bird.name} finds no pitch in which it hangs at rest at {speed_mps:.4g} m/s; allowed: larger "
            "fins farther behind the bridle (fin_area_m2, fin_station_m), or another bridle_m"
        )
        raise RequestError(msg)
    what = (
        "lifts off" if not equilibrium.upright else f"trails {math.degrees(equilibrium.trail):.0f} deg behind the hook"
    )
    ways = (
        _heavier(tow, bird, speed_mps, density),
        _slower(chain, bird, speed_mps, density),
        "a shorter or thinner rope",
    )
    msg = (
        f"tow.body.mass_kg: {chain.body.mass_kg:g} kg are too light for their drag and that of the rope: at "
        f"{speed_mps:.4g} m/s the bird {what}; allowed: up to {math.degrees(MOST_TRAIL):.0f} deg, that is "
        f"{', or '.join(way for way in ways if way)}"
    )
    raise RequestError(msg)


def _check_growth(chain: Chain, equilibrium: Equilibrium, speed_mps: float, density: float) -> None:
    """Refuse an unstable chain."""
    worst = modes(chain, equilibrium, speed_mps, density)[0]
    if worst.growth_ps <= MOST_GROWTH_PS:
        return
    how = f"swings up at {worst.frequency_hz:.2f} Hz" if worst.frequency_hz else "turns over"
    msg = (
        f"tow.rope: at {speed_mps:.4g} m/s the bird {how} without a gust, e-fold in {1.0 / worst.growth_ps:.1f} s; "
        f"allowed: {_steady_rope(chain, speed_mps, density)}larger fins farther behind (tow.body.fin_area_m2, "
        "fin_station_m), or another speed"
    )
    raise RequestError(msg)


def _steady_rope(chain: Chain, speed_mps: float, density: float) -> str:
    """Describe the shortest stable rope; empty if no rope helps."""
    length = chain.rope.length_m
    while length < LONGEST_M:
        length *= 1.05
        longer = replace(chain, rope=replace(chain.rope, length_m=length))
        if _flies(longer, speed_mps, density, most_ps=0.0):
            return f"a rope of at least {math.ceil(10.0 * length) / 10.0:g} m, "
    return ""


def _flies(chain: Chain, speed_mps: float, density: float, most_ps: float = MOST_GROWTH_PS) -> bool:
    """Whether a chain hangs under a carrier and is stable."""
    equilibrium = find_equilibrium(chain, speed_mps, density)
    if equilibrium is None or not hangs(equilibrium):
        return False
    return modes(chain, equilibrium, speed_mps, density)[0].growth_ps <= most_ps


def _heavier(tow: Tow, bird: Bird, speed_mps: float, density: float) -> str:
    """Describe the least mass that can be towed; empty if none can."""
    light = chain_of(tow, bird).body.mass_kg
    masses = np.geomspace(light, HEAVIEST_KG, 40)
    least = _edge(lambda mass: _flies(chain_of(tow, bird, mass), speed_mps, density), masses)
    return "" if least is None else f"at least {math.ceil(10.0 * least) / 10.0:g} kg"


def _slower(chain: Chain, bird: Bird, speed_mps: float, density: float) -> str:
    """Describe the largest speed at which a chain can be towed; empty if the bird's limits allow none."""
    speeds = np.linspace(speed_mps, min(speed_mps, bird.facts.limits.speed_mps[0]), 40)
    most = _edge(lambda speed: _flies(chain, speed, density), speeds)
    return "" if most is None else f"up to {math.floor(10.0 * most) / 10.0:.1f} m/s"


def _edge(holds: Callable[[float], bool], values: np.ndarray) -> float | None:
    """Find where a condition first holds along values, the first of which fails; None if nowhere."""
    good = next((k for k in range(1, len(values)) if holds(values[k])), None)
    if good is None:
        return None
    low, high = float(values[good - 1]), float(values[good])
    while abs(high - low) > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
