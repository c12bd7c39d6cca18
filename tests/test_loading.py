"""Loading: files, aircraft, overrides, and every problem in one pass with its place."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magsim import assets
from magsim.aircraft import load_aircraft
from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.scenario import TrackLog
from magsim.simulation import simulate
from magsim.terrain import Flat
from tests.support.scenarios import GOOD, problems


def test_the_digest_is_over_the_meaning(write):
    digest = load_scenario(write()).digest
    assert len(digest) == 64
    assert load_scenario(write("# a comment\n" + GOOD.replace("3000.0", "3_000"))).digest == digest
    assert load_scenario(write(GOOD + "[air]\nturbulence_severity = 0\n")).digest == digest
    assert load_scenario(write(GOOD.replace("seed = 1", "seed = 2"))).digest != digest
    assert load_scenario(write(), ["seed=2"]).digest != digest


def _bare(vehicle):
    """A copy of an aircraft or a bird without its fixed dipoles."""
    return replace(vehicle, magnetics=vehicle.magnetics.model_copy(update={"permanent": ()}))


@pytest.mark.parametrize(
    "change",
    [
        lambda loaded: {"aircraft": _bare(loaded.aircraft)},
        lambda loaded: {"aircraft": replace(loaded.aircraft, facts=loaded.aircraft.facts.loaded(fuel_kg=300.0))},
        lambda loaded: {"aircraft": replace(loaded.aircraft, files={"tank.stl": b"solid"})},
        lambda loaded: {"bird": _bare(loaded.bird)},
        lambda loaded: {"ground": None},
        lambda loaded: {"ground": replace(loaded.ground, geoid_m=1.0)},
        lambda loaded: {"ground": replace(loaded.ground, surface=Flat(1.0))},
        lambda loaded: {"track": TrackLog({"time": np.arange(9.0)})},
        lambda loaded: {"scenario": loaded.scenario.model_copy(update={"seed": 2})},
    ],
)
def test_the_digest_is_of_what_is_flown(change):
    """A changed copy has another digest, whatever was changed; an equal copy has the same."""
    loaded = load_scenario("towed_c208b", ["terrain.kind=flat"])
    assert replace(loaded, aircraft=replace(loaded.aircraft)).digest == loaded.digest
    assert replace(loaded, **change(loaded)).digest != loaded.digest


def test_the_digest_of_a_track_is_of_its_values():
    track = TrackLog({"time": np.arange(9.0), "alt": np.zeros(9)})
    moved = replace(track, values=track.values | {"alt": np.full(9, 1e-9)})
    assert moved.digest != track.digest == replace(track).digest


def test_every_mistake_in_one_pass_aircraft_limits_included(write):
    text = (
        GOOD.replace("3000.0", "9000.0")
        .replace("75.0", "300.0")
        .replace("= 5.0", "= [5.0, 50.0]")
        .replace('"cabin_center"', '"nose"')
        .replace("[pattern]", "wind = 3\n[pattern]")
    )
    mounts = ", ".join(load_scenario("calibration_c208b").aircraft.mounts)
    assert problems(write(text)) == [
        "s.toml:8: start.alt_m: 9000 m is above the ceiling of c208b; allowed: up to 7620",
        "s.toml:9: start.speed_mps: c208b cannot hold 300 m/s; allowed: 50 to 90",
        (
            "s.toml:11: start.wind: unknown key; "
            "known: lat_deg, lon_deg, alt_m, speed_mps, heading_deg, flap_deg, time_utc"
        ),
        (
            "s.toml:17: pattern.maneuvers[0].amplitude_deg: 50 deg is no pitch amplitude for c208b; "
            "allowed: above 0, up to 15"
        ),
        f"s.toml:21: sensors.scalar[0].mount: c208b has no mount 'nose'; allowed: {mounts}",
    ]


def test_an_unknown_aircraft_is_reported_with_everything_else(write):
    text = GOOD.replace('"c208b"', '"c208"').replace("seed = 1", "seed = -1")
    first, second = problems(write(text))
    assert first == "s.toml:2: seed: -1 is not allowed; allowed: a whole number of 0 or more, below 9223372036854775808"
    known = ", ".join(assets.list_aircraft())
    own = "or a folder of your own by its path with a slash, such as ./mine"
    assert second == f"s.toml:3: aircraft: there is no aircraft 'c208'; allowed: {known}, {own} (did you mean 'c208b'?)"


@pytest.fixture
def own(write, tmp_path):
    """A folder of a user's own beside the scenario; the scenario that flies it."""
    shutil.copytree(assets.aircraft_dir("c208b"), tmp_path / "mine")
    return write(GOOD.replace('"c208b"', '"./mine"'))


def test_an_own_aircraft_lies_where_the_scenario_does(own, tmp_path, monkeypatch):
    loaded = load_scenario(own)
    assert (loaded.aircraft.name, loaded.scenario.aircraft) == ("mine", "mine")
    assert loaded.aircraft.digest == load_aircraft("c208b").digest
    monkeypatch.chdir(tmp_path / "mine")
    assert load_scenario("../s.toml").digest == loaded.digest
    # typed at the command line, a path begins in the working folder
    assert load_scenario("calibration_c208b", ["aircraft=../mine"]).aircraft.name == "mine"
    # where the folder lies does not count, what its files say does
    (tmp_path / "away").mkdir()
    shutil.move(tmp_path / "mine", tmp_path / "away" / "mine")
    monkeypatch.chdir(tmp_path)
    assert load_scenario(own, ["aircraft=away/mine"]).digest == loaded.digest
    with (tmp_path / "away" / "mine" / "magnetics.toml").open("a") as file:
        file.write("# a comment\n")
    assert load_scenario(own, ["aircraft=away/mine"]).digest == loaded.digest
    path = tmp_path / "away" / "mine" / "magnetics.toml"
    path.write_text(path.read_text().replace("mu_r = 90.0", "mu_r = 91.0"))
    assert load_scenario(own, ["aircraft=away/mine"]).digest != loaded.digest


def test_what_is_wrong_with_an_own_aircraft_is_reported_with_everything_else(own):
    path = Path("mine/magnetics.toml")
    path.write_text(re.sub(r"mu_r = [\d.]+", "mu_r = 0.5", path.read_text(), count=1))
    Path("mine/facts.toml").unlink()
    (line,) = problems(own)
    assert line.startswith("s.toml:3: aircraft: mine: has no facts.toml; allowed: a folder with ")
    Path("mine/facts.toml").write_text("wings = 3\n")
    seed, *lines = problems(own, "seed=-1")[::-1]
    assert seed.startswith("--set seed: -1 is not allowed")
    assert all(line.startswith("s.toml:3: aircraft: mine/") for line in lines)
    assert any(re.search(r"magnetics.toml:\d+: steel\[0\].mu_r: 0.5 is not allowed; allowed: a num", s) for s in lines)
    assert any("facts.toml:1: wings: unknown key" in line for line in lines)


def test_an_aircraft_flies_instead_of_the_one_that_a_scenario_names():
    drone = load_aircraft("uav")
    loaded = load_scenario("papers/001_fom", aircraft=drone)
    assert loaded.aircraft is drone
    assert loaded.digest == load_scenario("papers/001_fom").digest
    with pytest.raises(RequestError, match="uav cannot hold"):
        load_scenario("calibration_c208b", aircraft=drone)


def test_what_only_the_flight_finds_is_placed_too(write):
    loaded = load_scenario(write(), ["start.speed_mps=51", "start.alt_m=7000"])
    assert loaded.placed("pattern.maneuvers[0].axis: no") == "s.toml:15: pattern.maneuvers[0].axis: no"
    assert loaded.placed("start.speed_mps: no") == "--set start.speed_mps: no"
    assert loaded.placed("flight.flaps[0].leg: no") == "flight.flaps[0].leg: no"
    assert loaded.placed("aircraft c208b: no") == "aircraft c208b: no"
    with pytest.raises(
        RequestError, match=r"^--set start.speed_mps: .* no straight and level flight at 51 m/s and 7000"
    ):
        simulate(loaded)


def test_overrides_are_part_of_the_provenance(write):
    loaded = load_scenario(write(), ["start.alt_m=2500", "pattern.maneuvers[0].axis=roll"])
    assert loaded.scenario.start.alt_m == 2500.0
    assert loaded.overrides == ("start.alt_m=2500", "pattern.maneuvers[0].axis=roll")
    assert loaded.text == GOOD


def test_a_strength_of_turbulence_on_top_takes_the_place_of_the_other_kind():
    assert load_scenario("calibration_c208b").scenario.air.turbulence_mps > 0.0
    air = load_scenario("calibration_c208b", ("air.turbulence_severity=2",)).scenario.air
    assert (air.turbulence_severity, air.turbulence_mps) == (2, 0.0)
    air = load_scenario("gusty_c208b", ("air.turbulence_mps=0.5",)).scenario.air
    assert (air.turbulence_severity, air.turbulence_mps) == (0, 0.5)
    with pytest.raises(RequestError, match="two strengths"):
        load_scenario("calibration_c208b", ("air.turbulence_severity=2", "air.turbulence_mps=0.5"))


def test_changed_is_the_scenario_with_more_overrides(own, tmp_path, monkeypatch):
    loaded = load_scenario(own, ["start.alt_m=2500", "seed=2"])
    assert loaded.changed([]) is loaded
    monkeypatch.chdir(tmp_path.parent)  # paths of the file still begin in its folder
    changed = loaded.changed(["seed=4"])
    assert changed.overrides == ("start.alt_m=2500", "seed=2", "seed=4")
    assert (changed.scenario.seed, changed.scenario.start.alt_m) == (4, 2500.0)
    assert changed.aircraft is loaded.aircraft
    assert changed.placed("seed: no") == "--set seed: no"
    assert (
        loaded.changed(["aircraft=uav", "start.speed_mps=25", "sensors.scalar[0].mount=nose_boom"]).aircraft.name
        == "uav"
    )
    with pytest.raises(RequestError, match=r"^--set start.alt_m: -1 is not allowed"):
        loaded.changed(["start.alt_m=-1"])
