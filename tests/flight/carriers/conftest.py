"""The kinematic helicopter, its bird, and scenarios for them."""

from collections.abc import Callable

import pytest

from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.planning import FlyableScenario
from magsim.scenario import Scenario
from tests.support.helicopters import HEIGHT_M, PLACES, SPEED_MPS, STILL


@pytest.fixture(scope="session")
def helicopter() -> Aircraft:
    return load_aircraft("helicopter")


@pytest.fixture(scope="session")
def bird() -> Bird:
    return load_bird("bird")


@pytest.fixture(scope="session")
def helicopter_scenario(helicopter: Aircraft, bird: Bird) -> Callable[..., Scenario]:
    """Make a scenario of a pattern and a place; other tables by keyword."""

    def make(pattern: dict, place: str = "middle", **tables: object) -> Scenario:
        lat, lon, course = PLACES[place]
        start = {"lat_deg": lat, "lon_deg": lon, "heading_deg": course, "alt_m": HEIGHT_M, "speed_mps": SPEED_MPS}
        raw = {
            "schema": 1,
            "seed": 1,
            "aircraft": "helicopter",
            "start": start | tables.pop("start", {}),
            "pattern": pattern,
            "flight": STILL,
            "sensors": {"scalar": [{"name": "cabin", "mount": "cabin"}]},
        }
        return FlyableScenario.model_validate(raw | tables, context={"aircraft": helicopter, "bird": bird})

    return make
