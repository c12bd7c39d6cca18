"""The sets of flights of ``tests/benchmarks/physics_methods.py``: what the sweep files fly, and how it is read back."""

from pathlib import Path

import numpy as np
import pytest

from magsim import sweep
from magsim.recording import Recording, write_recordings
from tests.benchmarks.physics_rows import sets

LEVELS = sets.HERE / "levels.toml"


@pytest.fixture(scope="module")
def flights():
    return [*sweep.read_sweep(LEVELS).space.flights(0, 36)]


def test_one_file_holds_one_set_whose_flights_are_flown_once_each(flights):
    assert len(flights) == len(sets.LEVELS) * len(sets.ROLES)
    assert [flight.number for flight in flights] == list(range(36))
    assert [flight.flown for flight in flights] == [0] * 12 + [1] * 12 + [2] * 12
    for role in range(3):
        flown = [flight.values for flight in flights[12 * role : 12 * role + 12]]
        assert len({values["start.heading_deg"] for values in flown}) == 1
        assert len({values["start.time_utc"] for values in flown}) == 1


def test_levels_have_the_physics_of_their_names(flights):
    level = {name: flights[i].values for i, name in enumerate(sets.LEVELS)}
    kinds = ("eddy.lag", "hinged.enabled", "crust.enabled", "variation.enabled", "electronics.enabled")
    on = {name: {kind for kind in kinds if values[f"field.{kind}"]} for name, values in level.items()}
    late = {name: values["sensors.fluxgate[0].skew_s"] for name, values in level.items()}
    assert on["0"] == on["5"] == on["0c"] == on["7"] == on["8"] == set()
    assert on["1"] == on["1c"] == {"eddy.lag"}
    assert on["2"] == {"hinged.enabled"}
    assert on["3"] == {"crust.enabled", "variation.enabled"}
    assert on["4"] == {"electronics.enabled"}
    assert on["6"] == on["6m"] == set(kinds)
    assert {name for name in level if late[name] == 0.15} == {"5", "6", "6m", "8"}
    assert {name for name in level if level[name]["field.memory.enabled"]} == {"7", "6m"}
    assert {name for name in level if level[name]["field.propeller.enabled"]} == {"6m"}
    assert {name for name in level if level[name]["sensors.scalar[0].mount"] == "sgl_mag_1"} == {"8"}
    assert {name for name in level if level[name]["sensors.fluxgate[0].mount"] == "cabin_center"} == {"0c", "1c"}


def test_what_is_tuned_on_is_not_what_is_shown():
    tune, show = sets.DRAWS["tune"], sets.DRAWS["show"]
    assert tune.seed != show.seed
    for first, flights in (("individual", 1), ("flight", 2)):
        tuned, seen = (
            {getattr(draw, first) + i for i in range(flights * draw.honest_sets)} for draw in sets.DRAWS.values()
        )
        assert tuned.isdisjoint(seen)
    assert show.seed == sweep.read_sweep(LEVELS).settings.seed


def test_a_set_is_read_from_the_place_where_it_was_flown(tmp_path):
    for shard in range(2):
        _write(tmp_path, shard, range(36 * shard, 36 * shard + 36))
    found = [*sets.sets(tmp_path, "6")]
    assert [[flight.name for flight in triple] for triple in found] == [
        ["f00000006", "f00000018", "f00000030"],
        ["f00000042", "f00000054", "f00000066"],
    ]
    assert [flight["split"].tolist() for flight in found[0]] == [[0.0] * 3, [0.0] * 3, [2.0] * 3]
    assert len([*sets.sets(tmp_path, "0", 1)]) == 1


def test_the_other_aircraft_of_a_set_is_the_next_individual(tmp_path):
    for shard in range(3):
        _write(tmp_path / "days", shard, (2 * shard, 2 * shard + 1))
        _write(tmp_path / "nominal", shard, (90 + shard,))
    found = [[int(flight.name[1:]) for flight in one] for one in sets.days(tmp_path)]
    assert found == [[90, 0, 1, 2], [91, 2, 3, 4], [92, 4, 5, 0]]
    assert len([*sets.days(tmp_path, 2)]) == 2


def _write(folder: Path, shard: int, numbers) -> None:
    time_s = np.arange(3.0)
    folder.mkdir(exist_ok=True)
    flights = [Recording(f"f{number:08d}", time_s, {"split": np.zeros(3)}) for number in numbers]
    write_recordings(folder / f"shard_{shard:08d}.h5", flights)


@pytest.mark.parametrize("world", sets.WORLDS)
def test_a_world_is_flown_with_its_scenario_and_a_departing_main_field(world):
    plan = sweep.read_sweep(sets.HERE / "honest.toml", sets.days_settings(world, sets.DRAWS["tune"]))
    loaded = plan.load(next(plan.space.flights(11, 12)))
    assert loaded.scenario.field.earth.departure.enabled
    assert {one.name for one in loaded.scenario.sensors.scalar} == set(sets.WORLDS[world].sensors)
    assert (loaded.scenario.individual, loaded.scenario.day) == (106, 2)
    nominal = sweep.read_sweep(sets.HERE / "honest.toml", sets.nominal_settings(world, sets.DRAWS["tune"]))
    shipped = nominal.load(next(nominal.space.flights(5, 6))).scenario
    assert (shipped.individual, shipped.day, shipped.seed) == (0, 0, 1106)
    assert shipped.field.earth.departure.enabled


def test_the_file_as_it_stands_flies_what_is_shown():
    plan = sweep.read_sweep(sets.HERE / "honest.toml")
    made = sweep.read_sweep(sets.HERE / "honest.toml", sets.days_settings("calm", sets.DRAWS["show"]))
    assert [flight.values for flight in plan.space.flights(0, 99)] == [
        flight.values for flight in made.space.flights(0, 99)
    ]
