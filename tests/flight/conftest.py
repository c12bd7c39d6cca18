"""The Cessna, and scenarios for it."""

from collections.abc import Callable

import pytest

from magsim.aircraft import Aircraft, load_aircraft
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario


@pytest.fixture(scope="session")
def cessna() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="session")
def scenario_of(cessna: Aircraft) -> Callable[..., Scenario]:
    """Make a scenario of a pattern; other tables by keyword."""

    def make(pattern: dict, *, start: dict | None = None, **tables: object) -> Scenario:
        place = {"lat_deg": 16.72, "lon_deg": 112.729, "alt_m": 3000.0, "speed_mps": 75.0}
        raw = {
            "schema": 1,
            "seed": 1,
            "aircraft": "c208b",
            "start": place | (start or {}),
            "pattern": pattern,
            "sensors": {"scalar": [{"name": "cabin", "mount": next(iter(cessna.mounts))}]},
        }
        return FlyableScenario.model_validate(raw | tables, context={"aircraft": cessna})

    return make
