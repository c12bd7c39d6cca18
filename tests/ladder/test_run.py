"""Runs of a ladder: the same tables however they are broken off; nothing on the disk before its time."""

import csv
import json

import numpy as np
import pytest

from magsim.benchmark.contest import Allowance, Contestant
from magsim.compensation import create
from magsim.dataset import training_rows
from magsim.errors import DataError, RequestError
from magsim.ladder import run as running
from magsim.ladder.board import make_board
from magsim.ladder.board_files import write_board
from magsim.ladder.flights import fly_set
from magsim.ladder.judged import CROP_S, SetTask, judge_set
from magsim.ladder.results import read_set
from magsim.ladder.run import Settings, check_entry, entries_of, run_ladder
from magsim.ladder.tracks import TRACKS, blind_of, training_of
from tests.support import scores as by_hand

METHODS = ("tl16", "tl16_measured")


def settings(sets=2, methods=METHODS, **changed):
    whole = {
        "levels": ("L0",), "tracks": ("no-labels", "open"), "sets": sets, "seed": 3,
        "methods": tuple(Contestant(name, name) for name in methods), "networks": (), "network_levels": (),
        "network_sets": 0, "limits": Allowance(fit_s=60.0, estimate_s=60.0), "command": "magsim benchmark --ladder",
    }  # fmt: skip
    return Settings(**whole | changed)


@pytest.fixture(scope="module")
def board_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("ladder") / "board"


@pytest.fixture
def whole(small_ladder, board_folder):
    """A finished run."""
    return run_ladder(settings(), board_folder, resume=board_folder.exists())


def tables(folder):
    """What must be the same again: pages and entered.csv have the times that were spent."""
    return {name: (folder / name).read_bytes() for name in ("scores.csv", "standings.csv")}


def test_scores_are_those_of_the_same_flights_judged_by_hand(small_ladder, whole, board_folder):
    flown = fly_set(small_ladder, small_ladder.chosen(("L0",)), 3, 1)["L0"]
    training = training_of(TRACKS["open"], flown, "cabin")
    method = create("tl16").fit_rows(training_rows(training, "cabin"))
    test = flown.tests["line"]
    estimate = method.interference(blind_of(TRACKS["open"], test, "cabin"))
    rows = test.time_s >= test.time_s[0] + CROP_S - 1e-9
    error = (test["mag_cabin_nt"] - test["clean_cabin_nt"] - estimate)[rows]
    key = ("open", "L0", 1, "cabin", "tl16", "all", "test", "std_nt")
    (found,) = [score.value for score in whole.scores if score[:8] == key]
    assert found == pytest.approx(by_hand.band_std(error, test.rate_hz), rel=1e-6)
    with np.load(board_folder / "sets" / "set_001.npz") as file:
        kept = file["L0/open/cabin/tl16/line"]
    assert kept.dtype == np.float32
    np.testing.assert_allclose(kept[rows], error, rtol=0, atol=1e-3)


def test_a_perfect_estimate_and_no_estimate_are_on_every_board(whole):
    metrics = {
        (s.method, s.metric): s.value for s in whole.scores if s.flight == "all" and s.set == 0 and s.track == "open"
    }
    assert metrics["none", "ir"] == pytest.approx(1.0)
    assert metrics["none", "gain"] == pytest.approx(1.0)
    assert metrics["noise_floor", "excess_pt"] == pytest.approx(0.0, abs=1e-6)
    for table in whole.tables:
        failed = {one.method for one in table.standings if one.failed}
        assert {"constant", "low_pass"} <= failed
        assert not failed & set(METHODS)
        assert {"none", "noise_floor"}.isdisjoint({one.method for one in table.standings})


def test_methods_that_need_labels_have_no_row_where_there_are_none(whole):
    table = next(table for table in whole.tables if table.track == "no-labels")
    assert "has no label" in table.lost["tl16"]
    assert {one.method for one in table.standings if not one.failed} == {"tl16_measured"}


def test_a_run_that_is_broken_off_ends_in_the_same_tables(small_ladder, whole, board_folder, tmp_path, monkeypatch):
    class Broken(Exception):
        pass

    judge = running.judge_set

    def once(task):
        if task.number == 1:
            # the set that is being judged is not on the disk, and the one before it is
            assert {path.name for path in (tmp_path / "run" / "sets").iterdir()} == {"set_000.json", "set_000.npz"}
            raise Broken
        return judge(task)

    monkeypatch.setattr(running, "judge_set", once)
    with pytest.raises(Broken):
        run_ladder(settings(), tmp_path / "run")
    monkeypatch.setattr(running, "judge_set", judge)
    before = (tmp_path / "run" / "sets" / "set_000.json").stat().st_mtime_ns
    run_ladder(settings(command="magsim benchmark --ladder"), tmp_path / "run", resume=True)
    assert (tmp_path / "run" / "sets" / "set_000.json").stat().st_mtime_ns == before
    assert tables(tmp_path / "run") == tables(board_folder)


def test_another_run_is_not_gone_on_with(whole, board_folder):
    with pytest.raises(RequestError, match=r"is of another run: it has other methods; -o names another folder"):
        run_ladder(settings(methods=("tl16",)), board_folder, resume=True)
    with pytest.raises(RequestError, match="holds files already: --resume goes on"):
        run_ladder(settings(), board_folder)


def test_a_damaged_set_is_named(whole, board_folder, tmp_path):
    path = tmp_path / "set_000.json"
    for text in ("", "[]", '{"format": 2}', '{"format": 1, "scores": {"rows": [[1]]}, "entered": {"rows": []}}'):
        path.write_text(text)
        with pytest.raises(DataError, match=r"set_000\.json is damaged"):
            read_set(path)


def test_what_was_written_is_read(whole, board_folder):
    found, entered = read_set(board_folder / "sets" / "set_000.json")
    assert repr(found) == repr([score for score in whole.scores if score.set == 0])
    assert repr(entered) == repr([one for one in whole.entered if one.set == 0])


def test_the_report_is_strict_json_and_says_what_it_was_made_of(small_ladder, whole, board_folder):
    def refuse(name):
        raise AssertionError(name)

    report = json.loads((board_folder / "report.json").read_text(), parse_constant=refuse)
    assert report["about"]["ladder_sha256"] == small_ladder.sha256
    assert report["about"]["seed"] == 3
    assert {"numpy", "scipy", "python", "machine"} <= set(report["about"]["environment"])
    assert len(report["tables"]) == 2


def test_tables_do_not_depend_on_the_order_of_methods(small_ladder):
    both = []
    for methods in (METHODS, METHODS[::-1]):
        entries = tuple(Contestant(name, name) for name in methods)
        both.append(judge_set(SetTask(0, 3, ("L0",), ("open",), entries, (), (), Allowance())))
    first, second = (sorted(map(repr, one.scores)) for one in both)
    assert first == second


def test_methods_that_there_are_not_are_refused_before_a_flight(tmp_path):
    with pytest.raises(RequestError, match="unknown method 'tl17'"):
        check_entry("tl17")
    with pytest.raises(RequestError, match=r"allowed: a file that is there and a class in it"):
        check_entry(f"{tmp_path}/mine.py:Mine")
    (tmp_path / "mine.py").write_text("raise SystemExit")
    check_entry(f"{tmp_path}/mine.py:Mine")  # it is not run here
    with pytest.raises(RequestError, match="two methods are called tl16"):
        entries_of(["tl16", "tl16"], quick=False)


def test_the_main_scores_have_a_row_for_each_method_and_set(whole, board_folder):
    with (board_folder / "sets.csv").open(encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    (one,) = [row for row in rows if (row["track"], row["method"], row["set"]) == ("open", "tl16", "1")]
    found = {s.metric: s.value for s in whole.scores if s[:6] == ("open", "L0", 1, "cabin", "tl16", "all")}
    for metric in ("std_nt", "ir", "excess_pt", "rmse0_nt"):
        assert float(one[metric]) == pytest.approx(found[metric], rel=1e-8)
    # anomalies of one height alone are in a set of one flight
    assert sum(one[f"gain_{height}"] != "nan" for height in ("0.1", "1", "20")) == 1


def test_a_board_of_nothing_is_empty(small_ladder, tmp_path):
    board = make_board({}, small_ladder, [], [])
    write_board(board, tmp_path)
    assert (tmp_path / "board.html").read_text().startswith("<!doctype html>")
