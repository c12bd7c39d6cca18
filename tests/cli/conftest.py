"""A recording file for commands."""

import pytest

from magsim.compensation import registry
from tests.support.worlds import World, calibration


@pytest.fixture(scope="session")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flights") / "flight.h5"
    calibration(World(circuits=2)).write(path)
    return path


@pytest.fixture
def own_folder(tmp_path, monkeypatch):
    """An empty current folder, and a registry of methods that forgets classes of files."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
