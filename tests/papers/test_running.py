"""Runs of a paper that is none: what is done once, what is taken up, what is refused."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from magsim.errors import DataError, RequestError
from magsim.papers import Cell, Column, Effort, Line, Paper, PaperFlight, PaperTable, Task, registry, run_paper, running
from magsim.papers.paper import found_of, values_of
from magsim.plots.spread import Series, spread

SETTINGS = ("recording.truth=none",)
DONE = []


def flights(effort):
    return [PaperFlight(f"fom_{k}", "papers/001_fom", (*SETTINGS, f"seed={k + 1}")) for k in range(effort.count(2, 1))]


def tasks(effort):
    return [Task("mean", (f"fom_{k}",), {"columns": ["mag_boom_nt"]}) for k in range(effort.count(2, 1))] * 2


def work(task, recordings, surroundings):
    DONE.append(task.text)
    surroundings.folder.mkdir(parents=True)
    (surroundings.folder / "state").write_text("half")
    (recording,) = recordings
    return {"mean": float(np.mean(recording[task.params["columns"][0]]))}


def tables(results):
    cell = Cell(55_000.0, values_of(results, "mean", "mean"))
    return [
        PaperTable("table_1", "Table 1", (Column("mean", "mean", "nT"),), (Line("reading", {"mean": cell}),), "flights")
    ]


def headlines(results):
    return {"mean_nt": Cell(None, values_of(results, "mean", "mean"))}


def figures(results):
    return {"figure_1": spread(["reading"], [Series("mean", [values_of(results, "mean", "mean")])], "nT")}


@pytest.fixture(autouse=True)
def _paper(monkeypatch):
    paper = Paper("999", "None", "nobody", flights, tasks, work, headlines, tables, figures)
    monkeypatch.setattr(running, "find_paper", lambda _number: paper)
    DONE.clear()


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return tmp_path_factory.mktemp("flown")


@pytest.fixture
def folder(flown, tmp_path):
    """A folder with the flights of a run, which are flown once for all tests."""
    if not (flown / "flights").exists():
        run_paper("999", flown)
        DONE.clear()
    shutil.copytree(flown, tmp_path / "run")
    return tmp_path / "run"


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_run_that_was_broken_off_goes_on_and_ends_the_same(folder):
    whole = content(folder)
    shutil.rmtree(folder / "tables")
    one = min((folder / "results").iterdir())
    one.unlink()
    lines = []
    run_paper("999", folder, announce=lines.append)
    assert len(DONE) == 1
    assert lines == [f"done 1 of 1: {DONE[0]}"]
    assert content(folder) == whole
    assert {path.name for path in folder.iterdir()} >= {"paper.json", "flights", "results", "tables", "figures"}
    assert not list(folder.glob("work/*"))


def test_work_that_two_tables_need_is_done_once(folder):
    shutil.rmtree(folder / "results")
    run = run_paper("999", folder)
    assert len(DONE) == 2
    cell = run.tables[0].cell("reading", "mean")
    assert run.headlines["mean_nt"].found == cell.found
    assert len(cell.found) == 4
    assert cell.found[:2] == cell.found[2:]


def test_results_of_other_sources_are_not_taken(folder):
    for path in (folder / "results").iterdir():
        kept = json.loads(path.read_text())
        path.write_text(json.dumps(kept | {"sources": "older"}))
    run_paper("999", folder)
    assert len(DONE) == 2


def test_what_is_no_run_of_this_kind_is_refused(folder, tmp_path):
    with pytest.raises(RequestError, match="is of another run: it has another quick, seeds"):
        run_paper("999", folder, Effort(quick=True, seeds=3))
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "letter.txt").write_text("dear reader")
    with pytest.raises(RequestError, match="holds files of something else"):
        run_paper("999", tmp_path / "other")
    (folder / "paper.json").write_text("{")
    with pytest.raises(DataError, match=r"paper\.json is damaged"):
        run_paper("999", folder)
    assert not DONE


def test_damaged_results_and_flights_are_named(folder):
    result = min((folder / "results").iterdir())
    result.write_text(result.read_text()[:-30])
    with pytest.raises(DataError, match=rf"{result.name} is damaged"):
        run_paper("999", folder)
    result.unlink()
    flight = folder / "flights" / "fom_0.h5"
    flight.write_bytes(flight.read_bytes()[:-100])
    (folder / "results" / result.name).unlink(missing_ok=True)
    for path in (folder / "results").iterdir():
        path.unlink()
    with pytest.raises(DataError, match=r"fom_0\.h5"):
        run_paper("999", folder)


@pytest.mark.parametrize(
    ("gpu", "message"),
    [
        (False, "paper 999 has no network that trains on cuda:99"),
        (True, "device cuda:99 asks for cuda:99, which is not"),
    ],
)
def test_a_device_that_is_not_there_is_refused_before_anything_is_written(gpu, message, tmp_path, monkeypatch):
    paper = replace(running.find_paper("999"), gpu=gpu)
    monkeypatch.setattr(running, "find_paper", lambda _number: paper)
    with pytest.raises(RequestError, match=message):
        run_paper("999", tmp_path / "run", Effort(device="cuda:99"))
    assert not (tmp_path / "run").exists()


def test_papers_are_found_by_their_numbers():
    assert [registry.find_paper(number).number for number in registry.numbers()] == [*registry.numbers()]
    with pytest.raises(RequestError, match="there is no paper '7'; allowed: "):
        registry.find_paper("7")


def test_tasks_are_told_by_all_that_they_are():
    one = Task("fit", ("a", "b"), {"method": "tl16"}, 1)
    assert one.key != Task("fit", ("b", "a"), {"method": "tl16"}, 1).key
    assert one.key == Task("fit", ("a", "b"), {"method": "tl16"}, 1).key
    assert one.text == "fit, method tl16: a, b, seed 1"
    results = [(one, {"std": 1.0}), (Task("fit", ("a", "b"), {"method": "bp"}), {"std": 2.0})]
    assert found_of(results, "fit", method="bp") == [{"std": 2.0}]
    assert values_of(results, "std", "fit") == (1.0, 2.0)
