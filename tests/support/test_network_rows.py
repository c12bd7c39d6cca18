"""The judging of networks in ``tests/benchmarks``: flights, search, journal."""

import math
from dataclasses import asdict

import numpy as np
import pytest

from magsim import sweep
from magsim.compensation import create
from magsim.recording import Recording, write_recordings
from tests.benchmarks.network_rows import adding, flights, measuring, search, spaces, subjects
from tests.benchmarks.network_rows.journal import Journal
from tests.benchmarks.network_rows.measuring import Case, Found, measured
from tests.benchmarks.physics_rows import sets
from tests.benchmarks.physics_rows.scoring import score
from tests.support.worlds import World, calibration


def test_levels_are_those_that_physics_methods_are_shown_on():
    ours = [*sweep.read_sweep("tuning/levels").space.flights(0, 6)]
    theirs = [*sweep.read_sweep(sets.HERE / "levels.toml").space.flights(0, len(sets.LEVELS))]
    for place, level in enumerate(flights.LEVELS):
        expected = theirs[sets.LEVELS.index(level)].values
        physics = {key: value for key, value in expected.items() if key.startswith(("field", "sensors"))}
        assert len(physics) > 10
        assert physics.items() <= ours[place].values.items()


def test_what_is_tuned_on_is_not_what_is_shown():
    seeds = [draw.seed for draw in (*flights.DRAWS.values(), *sets.DRAWS.values())]
    assert len(set(seeds)) == len(seeds)
    for name, size in flights.SWEEPS.items():
        plan = sweep.read_sweep(f"tuning/{name}")
        assert plan.settings.seed == flights.DRAWS["tune"].seed
        assert plan.settings.shard == size
        assert plan.settings.flights == flights.DRAWS["tune"].pairs * size


def test_the_courses_of_a_pair_are_drawn_for_each_flight():
    plan = sweep.read_sweep("tuning/levels")
    headings = [flight.values["start.heading_deg"] for flight in plan.space.flights(0, 6)]
    assert len(set(headings[:3])) == len(set(headings[3:])) == 1
    assert headings[0] != headings[3]


def test_pairs_are_read_from_where_they_were_flown(tmp_path):
    time_s = np.arange(3.0)
    for number in range(2):
        for name, size in flights.SWEEPS.items():
            first = number * size
            made = [Recording(f"f{first + i:08d}", time_s, {"split": np.zeros(3)}) for i in range(size)]
            (tmp_path / name).mkdir(exist_ok=True)
            write_recordings(tmp_path / name / f"shard_{number:08d}.h5", made)
    one = flights.pair(tmp_path, "4", 1)
    assert (one.train.name, one.tests["test"].name) == ("f00000007", "f00000010")
    assert one.tests["test"]["split"].tolist() == [2.0] * 3
    whole = flights.pair(tmp_path, "000", 1)
    assert whole.train is whole.tests["test"]
    assert whole.train.name == "f00000001"


def test_every_network_has_a_range_of_settings_that_it_takes():
    for name in measuring.networks():
        points = [spaces.trial(name, number, seed=3) for number in range(6)]
        assert points[0] == {}
        assert len({str(point) for point in points}) > 4
        for point in points:
            made = create(name, **{k: tuple(v) if isinstance(v, list) else v for k, v in point.items()})
            assert all(np.array_equal(made.get_params()[key], value) for key, value in point.items())


def test_trials_are_the_same_each_time_and_one_more_parameter_changes_no_other(monkeypatch):
    before = spaces.trial("bp", 4, seed=1)
    assert spaces.trial("bp", 4, seed=1) == before
    assert spaces.trial("bp", 4, seed=2) != before
    more = tuple({"a_new_one": spaces.OneOf((1, 2)), **space} for space in spaces.SPACES["bp"])
    monkeypatch.setattr(spaces, "SPACES", {"bp": more})
    after = spaces.trial("bp", 4, seed=1)
    assert after.pop("a_new_one") in (1, 2)
    assert after == before
    rates = [spaces.LogUniform(1e-3, 1e-1).draw(np.random.default_rng(seed)) for seed in range(400)]
    assert min(rates) >= 1e-3
    assert max(rates) <= 1e-1
    assert np.mean(np.array(rates) < 1e-2) == pytest.approx(0.5, abs=0.08)


def _scored(ir, over, fit_s=1.0):
    return {"tests": {"test": Found(ir, ir / over, 0.1, 0.1 * ir, 0.01, fit_s)._asdict()}}


def test_the_best_trial_has_the_highest_ratio_of_those_that_stay_above_their_stage():
    reached = {0: (100.0, 1.0), 1: (400.0, 0.9), 2: (200.0, 0.98)}
    trials = []
    for number, (ir, over) in reached.items():
        worlds = search.cases_of("bp", number, 1, 2)
        assert [len(cases) for cases in worlds] == [2, 2, 2, 2]
        results = [(case, _scored(100.0, 1.0)) for case in worlds[0]]
        results += [(case, _scored(ir, over, 3.0)) for cases in worlds[1:] for case in cases]
        trials.append(search.judged_trial("bp", number, 1, results))
    assert [one.over_stage for one in trials] == pytest.approx([1.0, 0.9, 0.98])
    assert trials[2].ir == pytest.approx(math.exp((math.log(100.0) + 3.0 * math.log(200.0)) / 4.0))
    assert trials[2].fit_s == 3.0
    assert search.best_of(trials) is trials[2]
    failed = search.judged_trial("bp", 1, 1, [(Case("bp", "4", 0), {"failed": "more than 30 s"})])
    assert not failed.allowed
    assert search.best_of([failed, trials[1]]) is None


def test_a_journal_goes_on_after_a_broken_line_and_forgets_other_sources(tmp_path):
    path = tmp_path / "there" / "found.jsonl"
    journal = Journal(path, "now")
    journal.add({"a": 1, "b": [2]}, {"x": (1, 2)})
    assert journal.get({"b": [2], "a": 1}) == {"x": [1, 2]}
    with path.open("a") as file:
        file.write('{"of": {"a": 2}, "sources": "now", "fou')
    again = Journal(path, "now")
    assert again.get({"a": 1, "b": [2]}) == {"x": [1, 2]}
    assert again.get({"a": 2}) is None
    again.add({"a": 2}, 7)
    assert [Journal(path, "now").get({"a": a, "b": [2]} if a == 1 else {"a": a}) for a in (1, 2)] == [{"x": [1, 2]}, 7]
    other = Journal(path, "later")
    assert other.get({"a": 2}) is None
    assert other.stale == 2


@pytest.fixture
def one_flight(monkeypatch):
    recording = calibration(World(circuits=2))
    monkeypatch.setattr(measuring, "read", lambda folder, case: flights.Judged(recording, {"test": recording}))


@pytest.mark.usefixtures("one_flight")
def test_a_case_is_fitted_and_judged_once(tmp_path):
    cases = [Case("bp", "4", 0, seed, {"steps": 2, "hidden": [3]}) for seed in (0, 1)]
    journal = Journal(tmp_path / "found.jsonl", "now")
    assert list(measured(cases, tmp_path, journal, until=0.0)) == []
    first = [*measured([cases[0], *cases], tmp_path, journal)]
    assert [case.seed for case, _ in first] == [0, 1]
    assert len((tmp_path / "found.jsonl").read_text().splitlines()) == 2
    again = [*measured([cases[0], *cases], tmp_path, Journal(tmp_path / "found.jsonl", "now"), until=0.0)]
    assert again == first
    found = Found(**first[0][1]["tests"]["test"])
    # two steps teach nothing: what is left is what the first stage leaves
    assert found.over_stage == pytest.approx(1.0, abs=0.2)
    flight = measuring.read(tmp_path, cases[0]).train
    assert found.stage_ir == pytest.approx(score(create("tl16").fit(flight), flight).ir)
    assert found.floor_nt < found.std_nt < found.raw_nt


@pytest.mark.usefixtures("one_flight")
def test_a_fit_over_its_time_is_a_failure_until_it_may_last_longer(tmp_path):
    case = Case("bp", "4", 0, params={"steps": 3, "every": 1, "hidden": [3]})
    journal = Journal(tmp_path / "found.jsonl", "now")
    ((_, found),) = measured([case], tmp_path, journal, limit_s=0.0)
    assert found == {"failed": "more than 0 s", "limit_s": 0.0}
    assert [*measured([case], tmp_path, journal, limit_s=0.0, until=0.0)] == [(case, found)]
    assert [*measured([case], tmp_path, journal, limit_s=60.0, until=0.0)] == []
    assert asdict(case)["params"] == {"steps": 3, "every": 1, "hidden": [3]}


def test_figures_are_medians_of_pairs_and_the_worst_start_weights_count():
    results = [
        (Case("magtcn", "000", number, seed), _scored(100.0 * over, over))
        for seed, some in enumerate([(4.0, 5.0, 1.0), (2.5, 1.5, 1.9)])
        for number, over in enumerate(some)
    ]
    rows = {row.name: row for row in subjects.seed_rows(results)}
    assert rows["magtcn_over_tl_000_seed_0"].value == pytest.approx(4.0)
    assert rows["magtcn_over_tl_000_worst_of_2_seeds"].value == pytest.approx(1.9)
    assert not rows["magtcn_over_tl_000_worst_of_2_seeds"].holds
    assert rows["magtcn_over_tl_000_worst_seed_and_pair"].value == pytest.approx(1.0)
    defaults = [(Case("bp", "4", number), _scored(50.0, over)) for number, over in enumerate((0.9, 0.98, 1.2))]
    rows = {row.name: row for row in subjects.default_rows(defaults)}
    assert rows["bp_over_stage_level_4"].value == pytest.approx(0.98)
    assert rows["bp_over_stage_level_4"].holds
    assert rows["bp_over_stage_level_4_worst_pair"].value == pytest.approx(0.9)
    with pytest.raises(RuntimeError, match="bp: world 4, 1, seed 0: diverged"):
        subjects.default_rows([(Case("bp", "4", 0), {"failed": "diverged"})])


def test_a_network_helps_where_the_whole_interval_says_so():
    over = {"flight": (1.2, 1.3, 1.25), "day": (1.001, 1.002, 1.003), "individual": (0.5, 0.6, 0.55)}
    results = []
    for case in adding.cases(["bp"], ["calm"], 3):
        tests = {name: _scored(100.0, values[case.number])["tests"]["test"] for name, values in over.items()}
        results.append((case, {"tests": tests}))
    found = adding.added(results)
    assert [one.test for one in found if one.helps] == ["flight"] * 2
    assert [one.test for one in found if one.harms] == ["individual"] * 2
    rows = {row.name: row.value for row in adding.rows(found)}
    assert (rows["helps_on_exact_norm"], rows["harms_on_exact_norm"]) == (1, 1)
    assert rows["bp_over_tl16_auxiliary_calm_flight"] == pytest.approx((1.2 * 1.3 * 1.25) ** (1 / 3))
    lines = adding.markdown(found).splitlines()
    assert len(lines) == 8
    assert "**1.25 (1.13 .. 1.38)**" in lines[2]
    assert "| calm | individual | 182 | 0.548 (" in lines[4]


def test_the_best_network_with_inputs_of_ours_says_what_it_adds():
    plan = subjects.Plan(("bp",), ("4",), 1)
    cases = subjects.ours_cases(plan)
    assert {case.world for case in cases} == {"4"}
    for case in cases:
        create(case.method, **{k: tuple(v) if isinstance(v, list) else v for k, v in case.params.items()})
    reached = {"tl16_auxiliary": (160.0, 1.1), "exact_norm": (2900.0, 1.0)}
    rows = {
        row.name: row for row in subjects.ours_rows([(c, _scored(*reached[c.params["first_stage"]])) for c in cases])
    }
    assert rows["bp_on_tl16_auxiliary_ir_level_4"].value == pytest.approx(160.0)
    best = rows["best_network_inputs_of_ours_ir_level_4"]
    assert best.holds
    assert best.unit == "1, bp on exact_norm, 1 times its stage"
