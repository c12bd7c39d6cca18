"""A small scenario as text, written to the working folder, and the problems of a wrong one."""

from collections.abc import Callable
from pathlib import Path

import pytest

from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import Scenario

GOOD = """\
schema = 1
seed = 1
aircraft = "c208b"

[start]
lat_deg = 16.7
lon_deg = 112.7
alt_m = 3000.0
speed_mps = 75.0

[pattern]
kind = "box"

[[pattern.maneuvers]]
axis = "pitch"
amplitude_deg = 5.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
"""

BARE = GOOD.replace('[[pattern.maneuvers]]\naxis = "pitch"\namplitude_deg = 5.0\n\n', "")

"""The same without maneuvers."""

WriteScenario = Callable[..., str]


def writer() -> WriteScenario:
    """Return a function that writes a text to ``s.toml`` in the working folder and returns that name."""

    def put(text: str = GOOD) -> str:
        Path("s.toml").write_text(text)
        return "s.toml"

    return put


def problems(path: str, *overrides: str) -> list[str]:
    """Return the lines of the error that a scenario raises."""
    with pytest.raises(RequestError) as caught:
        load_scenario(path, overrides)
    return str(caught.value).split("\n")


def over_the_sea(field: dict[str, object], sensors: dict[str, object]) -> Scenario:
    """Return a scenario of the Cessna for a flight that a test makes itself: settings of the field, and instruments."""
    return Scenario.model_validate(
        {
            "schema": 1,
            "seed": 1,
            "aircraft": "c208b",
            "start": {"lat_deg": 16.72, "lon_deg": 112.729, "alt_m": 3000.0, "speed_mps": 75.0},
            "pattern": {"kind": "box"},
            "field": field,
            "sensors": sensors,
        }
    )
