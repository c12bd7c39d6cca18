"""From a scenario and its type to what is flown: the individual, on its day, in that day's weather."""

from dataclasses import replace

from pydantic import ValidationError

from magsim.aircraft import Aircraft, Bird
from magsim.planning import FlyableScenario
from magsim.population.days import on_day, outside_c
from magsim.population.draws import Draws
from magsim.population.individuals import individual_of
from magsim.population.settings import GROUPS, Settings, refits
from magsim.scenario import Scenario

ATTEMPTS = 20
"""Most draws of a group of settings until the scenario takes them; then it keeps what it had."""


def what_is_flown(
    scenario: Scenario, aircraft: Aircraft, bird: Bird | None = None
) -> tuple[Scenario, Aircraft, Bird | None]:
    """Return the settings, the aircraft and the bird that a scenario means by its individual and its day.

    Parameters
    ----------
    scenario : Scenario
        As its file states it.
    aircraft, bird : Aircraft, Bird
        The types.

    Returns
    -------
    tuple
        The same objects where nothing is drawn: ``individual = 0``, ``day = 0`` and no refitted fluxgate.

    Raises
    ------
    RequestError
        If no individual can be built; the text names it.
    """
    number, day = scenario.individual, scenario.day
    draws = Draws(aircraft.name, number)
    settings = _on_day(scenario, aircraft, bird, draws) if day else scenario
    fitted = refits(settings, draws)
    if fitted:
        settings = _changed(settings, fitted, aircraft, bird)
    alt_m = scenario.start.alt_m
    air_c = outside_c(draws, day, alt_m)
    towed = None if bird is None else on_day(individual_of(bird, number), number, day, air_c)
    return settings, aircraft_of(aircraft, number, day, alt_m), towed


def aircraft_of(aircraft: Aircraft, number: int, day: int, alt_m: float) -> Aircraft:
    """Return an individual of a type on one of its days, in the air of a height [m].

    Raises
    ------
    RequestError
        If no individual can be built; the text names it.
    """
    air_c = outside_c(Draws(aircraft.name, number), day, alt_m)
    return on_day(individual_of(aircraft, number), number, day, air_c)


def _on_day(scenario: Scenario, aircraft: Aircraft, bird: Bird | None, draws: Draws) -> Scenario:
    """Return the scenario with what its day draws, group by group, as far as it is allowed."""
    for draw in GROUPS.values():
        for attempt in range(ATTEMPTS):
            drawn = draw(scenario, aircraft, replace(draws, attempt=attempt), f"day/{scenario.day}")
            if not drawn:
                break
            try:
                scenario = _changed(scenario, drawn, aircraft, bird)
            except ValidationError:
                continue
            break
    return scenario


def _changed(scenario: Scenario, settings: Settings, aircraft: Aircraft, bird: Bird | None) -> Scenario:
    """Return a scenario with further settings, checked like a file; what was left out stays so."""
    table = merged(scenario.model_dump(by_alias=True, exclude_unset=True), settings)
    return FlyableScenario.model_validate(table, context={"aircraft": aircraft, "bird": bird})


def merged(table: Settings, settings: Settings) -> Settings:
    """Return nested settings with others on top; lists are merged item by item."""
    out = dict(table)
    for key, value in settings.items():
        old = out.get(key)
        if isinstance(value, dict):
            out[key] = merged(old if isinstance(old, dict) else {}, value)
        elif isinstance(value, list):
            out[key] = [merged(item, change) for item, change in zip(old or [], value, strict=True)]
        else:
            out[key] = value
    return out
