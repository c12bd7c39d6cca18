"""The kinematic helicopter, its bird, and scenarios for them."""

from collections.abc import Callable
from functools import partial

import pytest

from magsim.aircraft import Aircraft, Bird, load_aircraft, load_bird
from magsim.scenario import Scenario
from tests.support.helicopters import scenario_of


@pytest.fixture(scope="session")
def helicopter() -> Aircraft:
    return load_aircraft("helicopter")


@pytest.fixture(scope="session")
def bird() -> Bird:
    return load_bird("bird")


@pytest.fixture(scope="session")
def helicopter_scenario(helicopter: Aircraft, bird: Bird) -> Callable[..., Scenario]:
    """Make a scenario of a pattern and a place; other tables by keyword."""
    return partial(scenario_of, helicopter, bird)
