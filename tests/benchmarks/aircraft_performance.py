"""Performance of the Cessna 208B beside what is published, as ``aircraft/c208b/README.md`` prints it.

Run ``python tests/benchmarks/aircraft_performance.py``. Speeds, climbs and ceilings come from JSBSim's trim of the twin
with the propeller's thrust, fuel flow and stall from flights of the turboprop in standard air.
"""

import math
import sys
from dataclasses import replace
from functools import cache

from scipy.optimize import minimize_scalar

from magsim.aircraft import Facts, load_aircraft
from magsim.earth.atmosphere import standard_density
from magsim.errors import RequestError
from magsim.flight.model.engines import available_thrust
from magsim.flight.model.setup import PlantSetup
from magsim.flight.model.start import start
from magsim.flight.model.trim import trimmed_twin
from magsim.units import FT, G0, LB, LBF, RHO0

KNOT = 0.514444
LOW_M = 20.0
"""Sea level, with the wheels clear of it."""
FT_MIN = FT / 60.0
CRUISE_PUBLISHED = (
    "171 cruise, 175 top, height not given (findaircraft.com)",
    "the same",
    "184 (skybrary): it set the drag and is no check",
    "as at sea level",
    "as at sea level",
)
TOP_FLOW = "335 to 370: 50 to 55 gal/h (bjtonline.com)"
SLOW_FLOW = "300 at 165 kt (planeandpilotmag.com, 2009)"
CLIMB = "975 (findaircraft.com); 1234 (general use, unsourced)"
CEILING = "25000 (findaircraft.com)"
CLEAN = "75 to 78 (general use, unsourced)"
DIRTY = "61 (findaircraft.com; twinandturbine.com, December 2011)"
CRUISE_FT = (0.0, 5000.0, 10000.0, 15000.0, 20000.0)


def still(alt_m: float, speed_mps: float, flap_deg: float = 0.0) -> PlantSetup:
    """North over the equator, without wind."""
    return PlantSetup(0.0, 0.0, alt_m, 0.0, speed_mps, flap_rad=math.radians(flap_deg))


def maximum_load(facts: Facts) -> Facts:
    """At the maximum take-off mass, the center of gravity inside its limits."""
    balance = facts.mass.balance
    payload = balance.maximum.value - balance.empty.value - balance.fuel.value
    return facts.loaded(payload, balance.fuel.value, 0.35)


def excess_thrust(facts: Facts, alt_m: float, speed_mps: float) -> float:
    """Thrust that is left in level flight [N]; far below zero where there is no level flight."""
    try:
        fdm = trimmed_twin(facts, still(alt_m, speed_mps))
    except RequestError:
        return -1.0e6
    needed = fdm["propulsion/engine/thrust-lbs"] * LBF
    return available_thrust(facts.engine, speed_mps, standard_density(alt_m)) - needed


@cache
def climb_rate(facts: Facts, alt_m: float) -> tuple[float, float]:
    """Best rate of climb [m/s] and its true airspeed [m/s]: excess power over weight."""

    def rate(speed_mps: float) -> float:
        return excess_thrust(facts, alt_m, speed_mps) * speed_mps / (facts.mass_kg * G0)

    slow = 48.0 * math.sqrt(RHO0 / standard_density(alt_m))
    best = minimize_scalar(lambda v: -rate(v), bounds=(slow, 1.3 * slow), method="bounded", options={"xatol": 0.5})
    return -float(best.fun), float(best.x)


@cache
def top_speed(facts: Facts, alt_m: float) -> float:
    """True airspeed of level flight with the lever forward [m/s]: the fastest one that can be trimmed."""
    low, high = 70.0, 120.0
    while high - low > 0.05:
        middle = 0.5 * (low + high)
        try:
            trimmed_twin(facts, still(alt_m, middle))
            low = middle
        except RequestError:
            high = middle
    return low


@cache
def ceiling(facts: Facts) -> float:
    """Height [m] at which the best rate of climb is 100 ft/min."""
    low, high = 3000.0, 10000.0
    while high - low > 20.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if climb_rate(facts, middle)[0] > 100.0 * FT_MIN else (low, middle)
    return low


@cache
def fuel_flow(facts: Facts, alt_m: float, speed_mps: float) -> float:
    """Fuel flow of level flight [kg/s], the turboprop settled."""
    fdm = start(facts, replace(still(alt_m, speed_mps), burn=True))
    before = fdm["propulsion/total-fuel-lbs"]
    for _ in range(120 * 20):
        fdm.run()
    return (before - fdm["propulsion/total-fuel-lbs"]) * LB / 20.0


@cache
def stall_speed(facts: Facts, flap_deg: float) -> float:
    """Lowest equivalent airspeed [m/s] while the lever is back and the height is held until the lift is lost."""
    speed = 50.0 if flap_deg == 0.0 else 43.0
    fdm = start(facts, still(500.0, speed, flap_deg))
    fdm["fcs/throttle-cmd-norm"] = -2.0
    lowest = speed
    while math.degrees(fdm["aero/alpha-rad"]) < 18.0 and fdm["simulation/sim-time-sec"] < 120.0:
        fdm.run()
        lowest = min(lowest, fdm["velocities/ve-fps"] * FT)
    return lowest


Row = tuple[str, float, str, str]
"""Quantity, value, unit, published."""


def rows(facts: Facts) -> list[Row]:
    """Compute the table of the aircraft's page."""
    heavy = maximum_load(facts)
    out = []
    for feet, published in zip(CRUISE_FT, CRUISE_PUBLISHED, strict=True):
        out.append(
            (f"top level speed, {feet:.0f} ft", top_speed(facts, max(LOW_M, feet * FT)) / KNOT, "KTAS", published)
        )
    fast = out[2][1] * KNOT
    out.append(
        (
            "fuel flow at that speed, 10000 ft",
            fuel_flow(facts, 10000.0 * FT, fast - 0.1) / LB * 3600.0,
            "lb/h",
            TOP_FLOW,
        )
    )
    out.append(
        (
            "fuel flow at 165 KTAS, 10000 ft",
            fuel_flow(facts, 10000.0 * FT, 165.0 * KNOT) / LB * 3600.0,
            "lb/h",
            SLOW_FLOW,
        )
    )
    out.append(("best climb at sea level, 8750 lb", climb_rate(heavy, LOW_M)[0] / FT_MIN, "ft/min", CLIMB))
    out.append(("service ceiling, 8750 lb", ceiling(heavy) / FT, "ft", CEILING))
    out.append(("stall, flaps up, 8750 lb", stall_speed(heavy, 0.0) / KNOT, "KCAS", CLEAN))
    out.append(("stall, flaps 30, 8750 lb", stall_speed(heavy, 30.0) / KNOT, "KCAS", DIRTY))
    return out


def lines(table: list[Row]) -> list[str]:
    """Write one line for each row."""
    return [
        f"| {what} | {round(value, -2 if unit == 'ft' else -1 if unit == 'ft/min' else 0):.0f} {unit} | {published} |"
        for what, value, unit, published in table
    ]


if __name__ == "__main__":
    sys.stdout.write("| what | model | published |\n")
    sys.stdout.write("\n".join(lines(rows(load_aircraft("c208b").facts))) + "\n")
