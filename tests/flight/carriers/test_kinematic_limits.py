"""Requests that a kinematic carrier cannot fly, and the ground."""

from collections.abc import Callable
from pathlib import Path

import pytest

from magsim.aircraft import Aircraft, Bird
from magsim.errors import DataError, RequestError
from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.scenario import Scenario
from tests.support.helicopters import LINE

ScenarioOf = Callable[..., Scenario]


TEXT = """\
schema = 1
seed = 1
aircraft = "helicopter"

[start]
lat_deg = 48.7
lon_deg = 127.2
alt_m = 1250.0
speed_mps = 28.0

[pattern]
kind = "straight"
leg_m = 1000.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin"

"""
KINEMATIC = "helicopter is kinematic"


def problem_of(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(folder)
    Path("s.toml").write_text(text)
    with pytest.raises(RequestError) as caught:
        load_scenario("s.toml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            '[[pattern.maneuvers]]\naxis = "roll"\namplitude_deg = 5.0\n',
            (
                f"s.toml:21: pattern.maneuvers[0].amplitude_deg: {KINEMATIC} and swings by its own sway alone; "
                "allowed: no maneuvers"
            ),
        ),
        (
            "[air]\nturbulence_severity = 2\n",
            (
                f"s.toml:20: air.turbulence_severity: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, "
                "flight.sway and tow.gusts"
            ),
        ),
        (
            "[[air.gusts]]\nat_s = 5.0\nduration_s = 3.0\nnorth_mps = 2.0\n",
            (
                f"s.toml:19: air.gusts: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, flight.sway and "
                "tow.gusts"
            ),
        ),
        (
            "[air.random_gusts]\nevery_s = 5.0\nspeed_mps = 2.0\n",
            (
                f"s.toml:19: air.random_gusts: {KINEMATIC}, no gust moves it; allowed: steady wind and shear, "
                "flight.sway and tow.gusts"
            ),
        ),
        (
            "[loading]\npayload_kg = 100.0\n",
            "s.toml:19: loading: no load changes the motion of a kinematic carrier; allowed: no table [loading]",
        ),
        (
            "[loading]\nburn_fuel = true\n",
            "s.toml:19: loading: Light helicopter, kinematic burns no fuel; allowed: burn_fuel = false",
        ),
        (
            "[[flight.flaps]]\ndeflection_deg = 10.0\nat_s = 3.0\n",
            "s.toml:20: flight.flaps[0].deflection_deg: helicopter has no flaps; allowed: none",
        ),
        (
            '[tow]\ncoupling = "two_way"\n',
            "s.toml:20: tow.coupling: a carrier without a flight model feels no rope; allowed: 'one_way'",
        ),
    ],
)
def test_what_needs_a_flight_model_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, more: str, message: str
) -> None:
    assert problem_of(TEXT + more, tmp_path, monkeypatch) == message


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        (
            "speed_mps = 28.0",
            "speed_mps = 3.0",
            "s.toml:9: start.speed_mps: helicopter cannot hold 3 m/s; allowed: 8 to 60",
        ),
        (
            "speed_mps = 28.0",
            "speed_mps = 28.0\nflap_deg = 5.0",
            "s.toml:10: start.flap_deg: helicopter has no flaps; allowed: 0",
        ),
        (
            '"straight"',
            '"fom"',
            f"s.toml:11: pattern: {KINEMATIC} and swings by its own sway alone; allowed: no maneuvers",
        ),
        (
            "leg_m = 1000.0",
            "leg_m = 1000.0\nbank_deg = 40.0",
            "s.toml:14: pattern.bank_deg: 40 deg is more bank than helicopter turns with; allowed: 5 to 30",
        ),
        (
            '"helicopter"',
            '"helicoper"',
            (
                "s.toml:3: aircraft: there is no aircraft 'helicoper'; allowed: c208b, helicopter, uav, or a folder of "
                "your own by its path with a slash, such as ./mine (did you mean 'helicopter'?)"
            ),
        ),
    ],
)
def test_what_it_cannot_fly_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, instead: str, message: str
) -> None:
    assert problem_of(TEXT.replace(line, instead), tmp_path, monkeypatch) == message


def test_a_flight_model_does_not_sway(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = TEXT.replace('"helicopter"', '"c208b"').replace("28.0", "60.0").replace('"cabin"\n\n', '"cabin_center"\n\n')
    message = "s.toml:20: flight.sway: c208b is flown by a flight model; allowed: for a kinematic carrier alone"
    assert problem_of(text + "[flight]\nsway = { lateral_m = 1.0 }\n", tmp_path, monkeypatch) == message


def test_the_ground_is_not_flown_into(helicopter_scenario: ScenarioOf, helicopter: Aircraft, bird: Bird) -> None:
    """The carrier by its own height; the bird by the rope's length."""
    low = {"start": {"alt_m": 20.0}}
    fly(helicopter_scenario(LINE, **low), helicopter)
    with pytest.raises(DataError, match=r"^the bird touched the ground at t = -4.0 s, -11 m above the ellipsoid"):
        fly(helicopter_scenario(LINE, **low, tow={"settle_s": 10.0}), helicopter, bird=bird)
    rising = {"flight": {"sway": {"lateral_m": 0.0, "vertical_m": 20.0}}, "start": {"alt_m": 5.0}}
    with pytest.raises(DataError, match=r"^the carrier touched the ground at t = -?\d+\.\d s, -?\d+ m above the "):
        fly(helicopter_scenario(LINE, **rising), helicopter)
