"""Recordings of the shipped scenarios, flown once for each test process; a writer of scenario files."""

from pathlib import Path

import pytest

from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate
from tests.support.scenarios import WriteScenario, writer


@pytest.fixture(scope="session")
def calibration() -> Recording:
    """The shipped calibration flight in still air."""
    return simulate(load_scenario("calibration_c208b_calm"))


@pytest.fixture(scope="session")
def paper_world() -> Recording:
    """The simulated world of paper 000."""
    return simulate(load_scenario("papers/000_simulated"))


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WriteScenario:
    """A function that writes a scenario into an empty working folder."""
    monkeypatch.chdir(tmp_path)
    return writer()
