"""Run a paper in a folder: fly, work, write tables and figures. What is there already is not done again.

The folder holds ``paper.json``, which says what run it is; ``flights/NAME.h5``; ``results/*.json``, one file for each
finished task; ``tables/`` as text, Markdown and CSV; ``figures/``, and all tables in ``tables.json``. Files are
written under other names and renamed, so that a run that is killed goes on, and ends in the same tables as one that
was not.
"""

import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from magsim import plots
from magsim.assets import scenario_path
from magsim.errors import DataError, RequestError
from magsim.generation.flying import FlightTask, fly
from magsim.generation.processes import run_all
from magsim.papers import tables as writing
from magsim.papers.paper import Effort, Found, Paper, PaperFlight, Results, Surroundings, Task
from magsim.papers.registry import find_paper
from magsim.papers.tables import Cell, PaperTable
from magsim.recording import Recording, read_recordings
from magsim.storage import atomic_text
from magsim.storage.sources import source_digest
from magsim.threads import one_blas_thread

HEAD = "paper.json"

Announce = Callable[[str], None]


@dataclass(frozen=True)
class PaperRun:
    """What a run came to: all tables, the figures that the paper stands for, and the files that were written."""

    tables: tuple[PaperTable, ...]
    headlines: Mapping[str, Cell]
    files: tuple[Path, ...]


def run_paper(
    number: str,
    folder: Path,
    effort: Effort | None = None,
    *,
    workers: int = 1,
    announce: Announce = lambda _line: None,
) -> PaperRun:
    """Re-run a paper, or go on with a run that was broken off.

    Parameters
    ----------
    number : str
        ``000`` to ``004``.
    folder : Path
        Of the run; made if it is not there.
    effort : Effort, optional
    workers : int
        Processes, each on one thread; the tables do not depend on it.
    announce : callable
        Called with a line of text at each step.

    Returns
    -------
    PaperRun

    Raises
    ------
    RequestError
        If there is no such paper or device, or the folder holds something else or another run.
    DataError
        If a flight or a result cannot be made or read.
    """
    paper, effort = find_paper(number), effort or Effort()
    _check_device(paper, effort.device)
    sources = _open(paper, folder, effort)
    flights = [*paper.flights(effort)]
    _fly(flights, folder, workers, announce)
    results = _work(paper, effort, folder, sources=sources, workers=workers, announce=announce)
    found, headlines = tuple(paper.tables(results)), paper.headlines(results)
    return PaperRun(found, headlines, tuple(_write(paper, results, found, headlines, folder)))


def _check_device(paper: Paper, name: str) -> None:
    if name == "cpu":
        return
    if not paper.gpu:
        msg = f"paper {paper.number} has no network that trains on {name}; allowed: cpu"
        raise RequestError(msg)
    from magsim.training.devices import find_device

    find_device(name)


def _open(paper: Paper, folder: Path, effort: Effort) -> str:
    """Make the folder, or take up the run that is in it; return the digest of the sources that results are of."""
    sources = source_digest(paper.tasks.__module__)
    head = {"paper": paper.number, **asdict(effort)}
    path = folder / HEAD
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists() and any(folder.iterdir()):
            msg = f"{folder} holds files of something else; allowed with -o: an empty folder, or one of this command"
            raise RequestError(msg)
        if path.exists():
            _check_head(path, head)
        else:
            atomic_text(path, json.dumps(head, indent=2) + "\n")
    except OSError as error:
        msg = f"cannot use the folder {folder}: {error.strerror}"
        raise RequestError(msg) from None
    return sources


def _check_head(path: Path, wanted: dict[str, object]) -> None:
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        msg = f"{path} is damaged: {error}; allowed: a folder of magsim paper"
        raise DataError(msg) from None
    if there != wanted:
        keys = [key for key in wanted if not isinstance(there, dict) or there.get(key) != wanted[key]]
        msg = f"{path} is of another run: it has another {', '.join(keys)}; take another folder with -o"
        raise RequestError(msg)


def _flight_path(folder: Path, name: str) -> Path:
    return folder / "flights" / f"{name}.h5"


def _fly(flights: Sequence[PaperFlight], folder: Path, workers: int, announce: Announce) -> None:
    """Fly what is missing, each into a file of its own."""
    missing = [one for one in flights if not _flight_path(folder, one.name).exists()]
    if not missing:
        return
    (folder / "flights").mkdir(exist_ok=True)
    tasks = [FlightTask(one.name, one.name, scenario_path(one.scenario), one.settings) for one in missing]
    for number, name in enumerate(run_all(partial(_fly_one, folder), tasks, workers), 1):
        announce(f"flown {number} of {len(tasks)}: {name}")


def _fly_one(folder: Path, task: FlightTask) -> str:
    fly(task).write(_flight_path(folder, task.name), force=True)
    return task.name


def _work(
    paper: Paper, effort: Effort, folder: Path, *, sources: str, workers: int, announce: Announce
) -> list[tuple[Task, Found]]:
    """Do what has no result yet; return all tasks with their results."""
    tasks = [*paper.tasks(effort)]
    known = {task.key: found for task in tasks if (found := _read(folder, task, sources)) is not None}
    # one that two tables need is done once
    missing = [*{task.key: task for task in tasks if task.key not in known}.values()]
    do = partial(_do, paper.number, folder, effort.device, sources)
    for number, (task, result) in enumerate(zip(missing, run_all(do, missing, workers), strict=True), 1):
        known[task.key] = result
        announce(f"done {number} of {len(missing)}: {task.text}")
    return [(task, known[task.key]) for task in tasks]


def _result_path(folder: Path, task: Task) -> Path:
    return folder / "results" / f"{task.digest}.json"


def _read(folder: Path, task: Task, sources: str) -> Found | None:
    """Return the result of a task; None if there is none, or one of other sources."""
    path = _result_path(folder, task)
    if not path.exists():
        return None
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["sources"] != sources or json.dumps(kept["task"], sort_keys=True) != task.key:
            return None
        found: Found = kept["found"]
    except (ValueError, KeyError, TypeError) as error:
        msg = f"{path} is damaged ({error}); remove it, and its work is done again"
        raise DataError(msg) from None
    return found


def _do(number: str, folder: Path, device: str, sources: str, task: Task) -> Found:
    """Do one task on one thread, and keep its result before it is returned."""
    scratch = folder / "work" / task.digest
    with one_blas_thread():
        recordings = [_read_flight(folder, name) for name in task.flights]
        found = find_paper(number).work(task, recordings, Surroundings(scratch, device))
    (folder / "results").mkdir(exist_ok=True)
    line = json.dumps({"task": asdict(task), "sources": sources, "found": found})
    atomic_text(_result_path(folder, task), line + "\n", force=True)
    shutil.rmtree(scratch, ignore_errors=True)
    # as it will be read
    back: Found = json.loads(line)["found"]
    return back


def _read_flight(folder: Path, name: str) -> Recording:
    (recording,) = read_recordings(_flight_path(folder, name))
    return recording


def _write(
    paper: Paper, results: Results, found: Sequence[PaperTable], headlines: Mapping[str, Cell], folder: Path
) -> list[Path]:
    """Write tables and figures; return their paths."""
    out = []
    (folder / "tables").mkdir(exist_ok=True)
    for table in found:
        forms = {"txt": writing.text(table), "md": writing.markdown(table), "csv": writing.as_csv(table)}
        for ending, content in forms.items():
            out.append(folder / "tables" / f"{table.key}.{ending}")
            atomic_text(out[-1], content, force=True)
    out.append(folder / "tables.json")
    about = {"paper": paper.number, "title": paper.title, "source": paper.source}
    document = {
        **about,
        "headlines": {name: writing.cell_as_json(cell) for name, cell in headlines.items()},
        "tables": [writing.as_json(table) for table in found],
    }
    atomic_text(out[-1], json.dumps(document, indent=2) + "\n", force=True)
    for name, figure in paper.figures(results).items():
        (folder / "figures").mkdir(exist_ok=True)
        out.append(folder / "figures" / f"{name}.png")
        plots.save(figure, out[-1], force=True)
    return out
