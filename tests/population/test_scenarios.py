"""Individuals in scenarios: which aircraft is loaded, what a recording says of it, and what a method is told."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.errors import RequestError
from magsim.loading import load_scenario
from magsim.population import individual_of
from magsim.recording import Recording
from magsim.simulation import compute_fields, record, simulate
from tests.support.measured import flight
from tests.support.scenarios import GOOD, problems

DRONE = GOOD.replace('"c208b"', '"uav"').replace("75.0", "25.0").replace("3000.0", "100.0")
DRONE += '[field.hinged]\nat_rest = ["aileron_left", "aileron_right"]\n'
DRONE = DRONE.replace('"cabin_center"', '"nose_boom"').replace('kind = "box"', 'kind = "box"\nleg_m = 1500.0')


def _recorded(loaded) -> Recording:
    """A recording of a flight made by hand."""
    return record(loaded, flight(), compute_fields(loaded, flight()))


def test_a_scenario_flies_the_individual_that_it_names(write) -> None:
    path = write()
    nominal, seventh = load_scenario(path), load_scenario(path, ["individual=7"])
    assert nominal.aircraft.nominal is None
    assert seventh.aircraft.magnetics == individual_of(nominal.aircraft, 7).magnetics
    assert seventh.aircraft.nominal == nominal.aircraft
    assert seventh.digest != nominal.digest
    # whatever the seed, and whatever else the scenario says
    other = load_scenario(path, ["individual=7", "seed=99", "start.alt_m=1000"])
    assert other.aircraft.magnetics == seventh.aircraft.magnetics


def test_further_settings_draw_from_the_type_and_not_from_the_individual(write) -> None:
    third = load_scenario(write(), ["individual=3"])
    assert third.changed(["seed=2"]).aircraft.digest == third.aircraft.digest
    assert third.changed(["individual=4"]).aircraft.digest == load_scenario("s.toml", ["individual=4"]).aircraft.digest
    back = third.changed(["individual=0"])
    assert back.aircraft.nominal is None
    assert back.digest == load_scenario("s.toml").digest


def test_a_tow_has_an_individual_bird_too() -> None:
    nominal, second = load_scenario("towed_c208b"), load_scenario("towed_c208b", ["individual=2"])
    assert second.bird.magnetics == individual_of(nominal.bird, 2).magnetics
    assert second.bird.magnetics != nominal.bird.magnetics


@pytest.mark.parametrize(("value", "text"), [("-1", "-1 is not allowed"), ("1.5", "1.5 is a number"), ("x", "'x'")])
def test_what_is_no_individual_is_refused(write, value: str, text: str) -> None:
    (line,) = problems(write(), f"individual={value}")
    assert line.startswith("--set individual: ")
    assert text in line


def test_what_cannot_be_built_is_refused_with_its_key(write, monkeypatch) -> None:
    def none(vehicle, number):
        raise RequestError(f"no individual {number} of {vehicle.name} can be built: x; allowed: parts farther apart")

    monkeypatch.setattr("magsim.population.flown.individual_of", none)
    (line,) = problems(write(), "individual=2")
    assert line.startswith("--set individual: no individual 2 of c208b can be built")


def test_individual_0_changes_no_byte_and_others_the_field_alone(write) -> None:
    path = write(DRONE)
    absent, zero, second = (
        _recorded(load_scenario(path, overrides)) for overrides in ([], ["individual=0"], ["individual=2"])
    )
    assert absent.meta["digest"] == zero.meta["digest"]
    assert set(absent.data) == set(zero.data) == set(second.data)
    for name in absent.data:
        np.testing.assert_array_equal(absent[name], zero[name])
    changed = {name for name in absent.data if not np.array_equal(absent[name], second[name], equal_nan=True)}
    assert "permanent_cabin_x_nt" in changed
    assert not any(name.startswith(("true_", "ins_", "surface_")) for name in changed)


def test_the_individual_is_provenance_and_no_method_sees_it(write, tmp_path) -> None:
    second = _recorded(load_scenario(write(DRONE), ["individual=2"]))
    assert second.meta["individual"] == 2
    second.write(tmp_path / "second.h5")
    assert Recording.read(tmp_path / "second.h5").meta["individual"] == 2
    assert "individual" not in second.labeled().meta
    assert "individual" not in second.blind().meta


def test_simulate_takes_the_key() -> None:
    loaded = load_scenario("papers/001_fom", ["individual=5"])
    replaced = replace(loaded, aircraft=individual_of(loaded.aircraft.nominal, 5))
    assert replaced.digest == loaded.digest
    with pytest.raises(RequestError, match="individual"):
        simulate("papers/001_fom", set={"individual": "five"})
