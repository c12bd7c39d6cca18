"""The toy carrier and its bird."""

import pytest

from magsim.aircraft import Aircraft, Bird
from tests.support.toy_tow import toy_aircraft, toy_bird


@pytest.fixture(scope="session")
def toy() -> Aircraft:
    return toy_aircraft()


@pytest.fixture(scope="session")
def bird() -> Bird:
    return toy_bird()
