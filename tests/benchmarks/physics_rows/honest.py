"""Worlds that are not kind: the same flight, another day, another aircraft; beside Tolles-Lawson and the floor."""

import statistics
from collections.abc import Mapping, Sequence

from tests.benchmarks.physics_rows.intervals import geometric_mean
from tests.benchmarks.physics_rows.scoring import AUXILIARY, OURS, PLAIN, Score, fitted, score
from tests.benchmarks.physics_rows.sets import WORLDS, Days, days
from tests.benchmarks.physics_rows.shown import Shown, tell
from tests.benchmarks.rows import Row, stated, within

METHODS = (PLAIN, AUXILIARY, OURS)

UPDATE_S = 120.0
"""What is flown of another aircraft to update an old calibration."""

CASES: Mapping[str, str] = {
    "shipped": "nominal aircraft, fitted to circuit 1, judged on circuit 2",
    "same_flight": "an individual with people aboard, fitted to circuit 1, judged on circuit 2",
    "another_day": "fitted on the day before",
    "another_aircraft": "its own calibration",
    "another_aircraft_old": "fitted to the first aircraft",
    "another_aircraft_updated": "fitted to the first aircraft and to two minutes of this one",
}


def rows(shown: Shown) -> Sequence[Row]:
    """Score every world, sensor and case."""
    out: list[Row] = []
    covered: list[float] = []
    for world, about in WORLDS.items():
        for sensor in about.sensors:
            tell(f"honest world {world}, sensor {sensor}")
            found: dict[tuple[str, str], list[Score]] = {}
            for one in days(shown.world(world), shown.count):
                for key, value in _scores(one, sensor).items():
                    found.setdefault(key, []).append(value)
            out += _rows(f"{world}_{sensor}", found)
            covered += [100.0 * one.covered for case in CASES for one in found.get((case, OURS), []) if _trusted(case)]
    return [*out, within("coverage_pct_honest", statistics.mean(covered), "%, mean of all flights", 85.0, 99.0)]


def _trusted(case: str) -> bool:
    """Whether the intervals of a fit are meant for the flight: they know nothing of other aircraft and days."""
    return case in ("shipped", "same_flight", "another_aircraft")


def _scores(one: Days, sensor: str) -> dict[tuple[str, str], Score]:
    """Return the scores of one set by case and method."""
    start = one.other.take(one.other.time_s < one.other.time_s[0] + UPDATE_S)
    out = {}
    for name in METHODS:
        nominal, nominal_s = fitted(name, [one.nominal], sensor)
        first, first_s = fitted(name, [one.first], sensor)
        other, other_s = fitted(name, [one.other], sensor)
        updated, updated_s = fitted(name, [one.first, start], sensor)
        for case, method, flight, fit_s in (
            ("shipped", nominal, one.nominal, nominal_s),
            ("same_flight", first, one.first, first_s),
            ("another_day", first, one.later, first_s),
            ("another_aircraft", other, one.other, other_s),
            ("another_aircraft_old", first, one.other, first_s),
            ("another_aircraft_updated", updated, one.other, updated_s),
        ):
            out[case, name] = score(method, flight, fit_s, covered=name == OURS)
    return out


def _rows(where: str, found: Mapping[tuple[str, str], Sequence[Score]]) -> list[Row]:
    out = []
    for case, meaning in CASES.items():
        for name in METHODS:
            mean = geometric_mean([one.ir for one in found[case, name]])
            out.append(stated(f"honest_ir_{where}_{case}_{name}", mean.value, f"1, {mean.text}; {meaning}"))
        floor = geometric_mean([one.raw_nt / one.floor_nt for one in found[case, OURS]])
        people = geometric_mean([one.raw_nt / one.people_nt for one in found[case, OURS]])
        out += [
            stated(f"honest_ir_{where}_{case}_all_but_people", people.value, f"1, {people.text}"),
            stated(f"honest_ir_{where}_{case}_noise_floor", floor.value, f"1, {floor.text}"),
        ]
        shares = [100.0 * one.covered for one in found[case, OURS]]
        out.append(stated(f"coverage_pct_{where}_{case}", statistics.mean(shares), "%, mean of the flights"))
    return out
