"""Arguments of ``magsim.simulate``: each wrong one gets one line that names what is allowed."""

from pathlib import Path

import pytest

import magsim
from magsim.errors import RequestError
from magsim.loading import LoadedScenario, load_scenario
from magsim.scenario import Scenario
from magsim.simulation import simulate
from tests.support.measured import loaded

ALLOWED = "allowed: the name of a shipped scenario, the path of a TOML file, or the LoadedScenario that load_scenario"


class Flown(Exception):
    """Raised in place of a flight."""


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> list[LoadedScenario]:
    """Scenarios that would have been flown."""
    scenarios: list[LoadedScenario] = []

    def fly(scenario: Scenario, *_: object, **__: object) -> None:
        scenarios.append(scenario)
        raise Flown

    monkeypatch.setattr("magsim.simulation.simulator.fly", fly)
    return scenarios


def message(*args: object, **options: object) -> str:
    with pytest.raises(RequestError) as caught:
        simulate(*args, **options)
    return str(caught.value)


@pytest.mark.parametrize("kind", ["name", "name.toml", "path", "text", "loaded"])
def test_a_name_a_path_and_a_loaded_scenario(flown, write, kind):
    write()
    named = {
        "name": "calibration_c208b",
        "name.toml": "calibration_c208b.toml",
        "path": Path("s.toml"),
        "text": "s.toml",
    }
    with pytest.raises(Flown):
        simulate(load_scenario("s.toml") if kind == "loaded" else named[kind], seed=9, set={"start.alt_m": 2500})
    assert (flown[0].seed, flown[0].start.alt_m, flown[0].aircraft) == (9, 2500.0, "c208b")


def test_it_is_the_function_of_the_package():
    assert magsim.simulate is simulate


@pytest.mark.parametrize(
    ("scenario", "start"),
    [
        (3, f"scenario: is of type int; {ALLOWED}"),
        (None, f"scenario: is of type NoneType; {ALLOWED}"),
        (loaded().scenario, f"scenario: is a Scenario, without its aircraft and files; {ALLOWED}"),
        ("own.toml", "own.toml: there is no such file, and no shipped scenario has that name"),
        ("calibration_c208", "calibration_c208: there is no such file, and no shipped scenario has that name (did you"),
    ],
)
def test_what_is_no_scenario(scenario, start):
    text = message(scenario)
    assert text.startswith(start)
    assert "\n" not in text


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"seed": "x"}, "--set seed: 'x' is text; allowed: a whole number of 0 or more, below 9223372036854775808"),
        ({"seed": 1.5}, "--set seed: 1.5 is a number; allowed: a whole number of 0 or more"),
        ({"seed": True}, "--set seed: true is not allowed; allowed: a whole number of 0 or more"),
        ({"seed": -1}, "--set seed: -1 is not allowed; allowed: a whole number of 0 or more"),
        ({"seed": object()}, "seed: a value of type object is no TOML value"),
        ({"seed": 1, "set": {"seed": 2}}, "seed: is given twice, as an argument and in set; allowed: one of them"),
        ({"set": ["seed=2"]}, "set: is of type list; allowed: a mapping of key paths to values"),
        ({"set": {"start.alt": 2}}, "--set start.alt: unknown key (did you mean 'alt_m'?)"),
        ({"set": {"start.alt_m": "high"}}, "--set start.alt_m: 'high' is text; allowed: a number above 0"),
        ({"set": {"air.turbulence_severity": 9}}, "--set air.turbulence_severity: 9 is not allowed; allowed: a whole"),
        ({"set": {"air.turbulence_severity": None}}, "set: air.turbulence_severity: None is no TOML value"),
        ({"progress": 3}, "progress: is of type int; allowed: a function of a step's name and its share done"),
    ],
)
def test_wrong_options(options, text):
    assert message("calibration_c208b", **options).startswith(text)


def test_every_wrong_setting_in_one_pass():
    text = message("calibration_c208b", seed=-1, set={"start.alt_m": -5.0, "recording.rate_hz": 7})
    assert [line.split(": ")[0] for line in text.splitlines()] == [
        "--set start.alt_m",
        "--set recording.rate_hz",
        "--set seed",
    ]


def test_a_scenario_that_was_made_by_hand_takes_no_settings():
    assert message(loaded(), seed=3) == "toy_box: was not read from a file; allowed: without further settings"
