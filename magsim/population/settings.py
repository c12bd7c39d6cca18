"""What a day sets in a scenario: load, weather, daily variation, temperature of the instruments.

A key that the scenario states stays; only what it leaves to its default is drawn.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel

from magsim.aircraft import Aircraft, Facts, KinematicFacts
from magsim.earth.atmosphere import standard_temperature_c
from magsim.population.days import departure_k
from magsim.population.draws import Draws, between, either_sign, lognormal, normal
from magsim.population.spreads import DAY, INDIVIDUAL
from magsim.scenario import Cabin, FluxgateSensor, Scenario, TrackPattern, Variation

Settings = dict[str, Any]
"""Nested settings as in a scenario file."""

MIN_C, MAX_C = -60.0, 80.0
"""Temperatures that a cabin may have."""


def given(model: BaseModel | None, *keys: str) -> bool:
    """Return whether a scenario states one of some keys of a table."""
    return model is not None and bool(model.model_fields_set.intersection(keys))


def loading(scenario: Scenario, aircraft: Aircraft, draws: Draws, day: str) -> Settings:
    """Draw payload and fuel."""
    facts, load = aircraft.facts, scenario.loading
    if isinstance(facts, KinematicFacts) or facts.mass.balance is None or isinstance(scenario.pattern, TrackPattern):
        return {}
    out: Settings = {}
    random, balance = draws(f"{day}/loading"), facts.mass.balance
    payload = balance.payload.value * (1.0 + DAY["payload"].size[0] * normal(random))
    fuel = balance.fuel_capacity.value * between(random, DAY["fuel"].size)
    if not given(load, "payload_kg"):
        out["payload_kg"] = payload
    if not given(load, "fuel_kg"):
        out["fuel_kg"] = fuel
    return {"loading": out} if out else {}


def air(scenario: Scenario, aircraft: Aircraft, draws: Draws, day: str) -> Settings:
    """Draw wind and light air; a logged track has its own, and no gust moves a kinematic carrier."""
    if isinstance(scenario.pattern, TrackPattern):
        return {}
    out: Settings = {}
    random, stated = draws(f"{day}/air_motion"), scenario.air
    north, east = (scenario.start.speed_mps * DAY["wind"].size[0] * normal(random) for _ in range(2))
    gusts = between(random, DAY["turbulence"].size)
    if not given(stated, "wind_north_mps", "wind_east_mps"):
        out |= {"wind_north_mps": north, "wind_east_mps": east}
    if isinstance(aircraft.facts, Facts) and not given(stated, "turbulence_severity", "turbulence_mps"):
        out["turbulence_mps"] = gusts
    return {"air": out} if out else {}


def variation(scenario: Scenario, aircraft: Aircraft, draws: Draws, day: str) -> Settings:
    """Draw daily variation, pulsations and drift; a scenario that switches them off keeps them off."""
    del aircraft
    stated = scenario.field.variation
    if stated is not None and not stated.enabled:
        return {}
    random, usual = draws(f"{day}/variation"), Variation()
    daily = lognormal(random, DAY["daily"].size[0])
    drawn: Settings = {"sq_nt": tuple(daily * value for value in usual.sq_nt)}
    for key in ("pc3_nt", "pc4_nt", "pc5_nt", "drift_nt"):
        drawn[key] = getattr(usual, key) * lognormal(random, DAY["pulsations"].size[0])
    return {"field": {"variation": {key: value for key, value in drawn.items() if not given(stated, key)}}}


def instruments(scenario: Scenario, aircraft: Aircraft, draws: Draws, day: str) -> Settings:
    """Draw the temperature of the cabin, and how fluxgates drift with it."""
    cabin = scenario.sensors.cabin
    random = draws(f"{day}/cabin")
    mean, scatter = DAY["cabin"].size
    settled, spent = mean + scatter * normal(random), between(random, DAY["climb"].size)
    departure = departure_k(draws, scenario.day)
    ground = standard_temperature_c(0.0) + departure
    if not crewed(aircraft):
        settled = standard_temperature_c(scenario.start.alt_m) + departure + DAY["bay"].size[0]
    warmup_s = Cabin().warmup_s if cabin is None else cabin.warmup_s
    start = settled + (ground - settled) * math.exp(-spent / warmup_s)
    drawn = {"start_c": start, "settled_c": settled}
    kept = {key: min(MAX_C, max(MIN_C, value)) for key, value in drawn.items() if not given(cabin, key)}
    gates = [_drifts(sensor, draws) for sensor in scenario.sensors.fluxgate]
    return {"sensors": {"cabin": kept, "fluxgate": gates}}


def crewed(aircraft: Aircraft) -> bool:
    """Return whether people are aboard, for whom a cabin is heated."""
    facts = aircraft.facts
    return isinstance(facts, KinematicFacts) or facts.limits.crew is not None


def _drifts(sensor: FluxgateSensor, draws: Draws) -> Settings:
    """Return the drifts of a fluxgate that the scenario leaves out: they belong to the individual, not to the day."""
    random = draws(f"fluxgate/{sensor.name}/drift")
    drawn = {
        "offset_drift_nt_c": either_sign(random, *INDIVIDUAL["offset_drift"].size),
        "scale_drift_ppm_c": either_sign(random, *INDIVIDUAL["scale_drift"].size),
    }
    return {key: value for key, value in drawn.items() if not given(sensor, key)}


def refits(scenario: Scenario, draws: Draws) -> Settings:
    """Draw the misalignment of each fluxgate that was refitted, on top of what the scenario states."""
    gates: list[Settings] = []
    for sensor in scenario.sensors.fluxgate:
        if not sensor.refit:
            gates.append({})
            continue
        random = draws(f"fluxgate/{sensor.name}/refit/{sensor.refit}")
        sigma = INDIVIDUAL["refit"].size[0]
        gates.append({"misalignment_deg": tuple(angle + sigma * normal(random) for angle in sensor.misalignment_deg)})
    return {"sensors": {"fluxgate": gates}} if any(gates) else {}


GROUPS: Mapping[str, Callable[[Scenario, Aircraft, Draws, str], Settings]] = {
    "loading": loading,
    "air": air,
    "variation": variation,
    "instruments": instruments,
}
"""What a day draws, each with a name for its streams; a group is drawn again where the scenario refuses it."""
