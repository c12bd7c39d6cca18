"""Individual 0 on day 0 is the flight without either key, and the flight of the modules that know neither."""

import numpy as np

from magsim import assets, config
from magsim.aircraft import load_aircraft
from magsim.flight import fly
from magsim.loading import LoadedScenario, load_scenario
from magsim.planning import FlyableScenario
from magsim.recording import Recording
from magsim.simulation import compute_fields, record
from tests.benchmarks.rows import Row, at_most

NAME, OVERRIDES = "patterns/straight", ("pattern.leg_m=6000.0",)


def _flown(loaded: LoadedScenario) -> Recording:
    flight = fly(loaded.scenario, loaded.aircraft)
    return record(loaded, flight, compute_fields(loaded, flight))


def _without_population() -> LoadedScenario:
    """The scenario as its file and the files of its aircraft say, put together here."""
    path, aircraft = assets.scenario_path(NAME), load_aircraft("c208b")
    document = config.read(path, overrides=OVERRIDES)
    scenario = document.validate(FlyableScenario, context={"aircraft": aircraft, "bird": None})
    return LoadedScenario(path.stem, scenario, aircraft, document.text, OVERRIDES)


def _changed_bytes(one: Recording, other: Recording) -> int:
    names = set(one.data) ^ set(other.data)
    count = sum(recording[name].nbytes for recording in (one, other) for name in names if name in recording)
    for name in set(one.data) & set(other.data):
        left, right = (np.ascontiguousarray(recording[name]).view(np.uint8) for recording in (one, other))
        count += int(np.count_nonzero(left != right))
    return count + (one.meta["digest"] != other.meta["digest"])


def rows() -> list[Row]:
    """Bytes of all columns that differ, and the digest."""
    absent = _flown(load_scenario(NAME, OVERRIDES))
    zero = _flown(load_scenario(NAME, (*OVERRIDES, "individual=0", "day=0")))
    return [
        at_most("individual_0_day_0_changed_bytes", _changed_bytes(absent, zero), "byte", 0),
        at_most("without_population_changed_bytes", _changed_bytes(absent, _flown(_without_population())), "byte", 0),
    ]
