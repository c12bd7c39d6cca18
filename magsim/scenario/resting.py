"""Settings that are stated and rest: a switch, a size or a table that they need is off.

What asks for something that cannot be is refused when a scenario is read. What only rests, because its part of the
world is switched off, is reported, so that one switch can be turned without taking its table apart. The switch
``enabled`` silences its whole table; other dependences are in ``NEEDS`` of the models, and between tables here.
"""

from collections.abc import Iterator, Mapping, Sequence

from pydantic import BaseModel

from magsim.aircraft import KinematicFacts, Vehicle
from magsim.config import Strict
from magsim.scenario.air import LogShear
from magsim.scenario.track import SURFACES, TrackPattern
from magsim.scenario.whole import Scenario

MODELED_ALONE = ("leg_tolerance_m", "surface_saturation_s", "throttle_saturation_s")
"""Keys of ``[flight]`` that watch over a flight in JSBSim."""

Table = Mapping[str, object]


def resting_settings(scenario: Scenario, table: Table, vehicles: Sequence[Vehicle]) -> Iterator[tuple[str, str]]:
    """Yield settings without effect, one entry for each table and reason: its key path, and text.

    Parameters
    ----------
    scenario : Scenario
        As it is flown.
    table : mapping
        What the file states, overrides included; values of presets do not count.
    vehicles : sequence of Vehicle
        The aircraft, and the bird that it tows.
    """
    yield from _within(scenario, table, "")
    for path, keys, why in (*_of_sensors(scenario, table, vehicles), *_of_flight(scenario, table, vehicles[0])):
        stated = _below(table, path)
        idle = [key for key in (stated if keys is None else keys) if key in stated and key != "enabled"]
        if idle and stated.get("enabled") is not False:
            yield path, f"{_have(idle)} no effect {why}"


def _within(model: BaseModel, table: Table, path: str) -> Iterator[tuple[str, str]]:
    """Yield what rests in a table because of another key of it, and in the tables below."""
    if getattr(model, "enabled", None) is False:
        idle = [key for key in table if key != "enabled"]
        if idle:
            yield path, f"{_have(idle)} no effect with enabled = false"
        return
    by_needs: dict[tuple[str, ...], list[str]] = {}
    for key, needs in (model.NEEDS if isinstance(model, Strict) else {}).items():
        if key in table and _acts(getattr(model, key)) and not any(_acts(getattr(model, need)) for need in needs):
            by_needs.setdefault(tuple(needs), []).append(key)
    for needs, idle in by_needs.items():
        yield path, f"{_have(idle)} no effect without {' or '.join(needs)}"
    for key, stated in table.items():
        below = getattr(model, key, None)
        for name, part, given in _parts(f"{path}.{key}" if path else key, below, stated):
            yield from _within(part, given, name)


def _parts(path: str, value: object, stated: object) -> Iterator[tuple[str, BaseModel, Table]]:
    """Yield the tables in a value, each with its path and what is stated of it."""
    if isinstance(value, BaseModel) and isinstance(stated, Mapping):
        yield path, value, stated
    elif isinstance(value, Mapping) and isinstance(stated, Mapping):
        for name in stated:
            yield from _parts(f"{path}.{name}", value.get(name), stated[name])
    elif isinstance(value, tuple) and isinstance(stated, list):
        for i, (one, given) in enumerate(zip(value, stated, strict=False)):
            yield from _parts(f"{path}[{i}]", one, given)


def _of_sensors(
    scenario: Scenario, table: Table, vehicles: Sequence[Vehicle]
) -> Iterator[tuple[str, Sequence[str] | None, str]]:
    """Yield tables of wiring and instruments with the keys that rest, None for all of them, and why."""
    feeders = [feeder for vehicle in vehicles for feeder in vehicle.magnetics.feeders]
    if not scenario.field.electronics.enabled:
        yield "sensors.electrical", None, "with field.electronics.enabled = false"
    elif not feeders:
        yield "sensors.electrical", None, "in an aircraft without feeders"
        yield "field.electronics", ("least_times_on",), "in an aircraft without feeders"
    elif not any(feeder.load.kind == "duty" for feeder in feeders):
        yield "field.electronics", ("least_times_on",), "in an aircraft without a load of kind 'duty'"
    pattern = scenario.pattern
    if isinstance(pattern, TrackPattern):
        if not any(getattr(pattern.columns, surface) for surface in SURFACES):
            yield "sensors.surfaces", None, "on a track that logs no surface"
    elif isinstance(vehicles[0].facts, KinematicFacts):
        yield "sensors.surfaces", None, "on a kinematic carrier, which moves no surface"
    cabin = scenario.sensors.cabin
    if cabin is None:
        gates = _below(table, "sensors").get("fluxgate")
        for i in range(len(gates) if isinstance(gates, list) else 0):
            drifts = "offset_drift_nt_c", "scale_drift_ppm_c", "reference_c"
            yield f"sensors.fluxgate[{i}]", drifts, "without a table [sensors.cabin]"
    elif cabin.start_c == cabin.settled_c:
        yield "sensors.cabin", ("warmup_s",), "where start_c is settled_c"


def _of_flight(scenario: Scenario, table: Table, aircraft: Vehicle) -> Iterator[tuple[str, Sequence[str] | None, str]]:
    """Yield tables of flight and air with the keys that rest, None for all of them, and why."""
    del table
    air = scenario.air
    if isinstance(air.shear, LogShear) and not any(air.wind_mps):
        yield "air", ("shear",), "without wind_north_mps or wind_east_mps, which it multiplies"
    if scenario.tow is None:
        yield "field.carrier", None, "without a table [tow]"
    if not any(dipole.seated for dipole in aircraft.magnetics.permanent):
        yield "field.crew", None, "where nobody is aboard; people come with a day"
    if isinstance(scenario.pattern, TrackPattern):
        moves = ("shear", "gusts", "random_gusts", "turbulence_severity", "turbulence_mps")
        why = "on a logged track, whose motion is that of its file"
        yield "air", None if scenario.tow is None else moves, why
        yield "loading", None, why
        yield "flight", ("warmup_s", "sway", *MODELED_ALONE), why
    elif isinstance(aircraft.facts, KinematicFacts):
        yield "flight", MODELED_ALONE, "on a kinematic carrier, which follows its path"


def _below(table: Table, path: str) -> Table:
    """Return the table at a path of what is stated; empty without one."""
    found: object = table
    for part in path.replace("[", ".[").split("."):
        if part.startswith("["):
            found = found[int(part[1:-1])] if isinstance(found, list) else {}
        else:
            found = found.get(part, {}) if isinstance(found, Mapping) else {}
    return found if isinstance(found, Mapping) else {}


def _acts(value: object) -> bool:
    """Whether a value has an effect: it is not zero, false or empty."""
    return any(map(_acts, value)) if isinstance(value, tuple) else bool(value)


def _have(keys: Sequence[str]) -> str:
    return f"{', '.join(keys)} {'has' if len(keys) == 1 else 'have'}"
