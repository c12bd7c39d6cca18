"""A run of a ladder in a folder: set by set, in processes, resumable, and its board at the end.

The folder holds ``ladder.json``, which says what run it is; ``sets/set_000.json`` and ``sets/set_000.npz``, the
scores and the raw errors of each finished set; and what ``magsim.ladder.board`` writes. A set is kept when every
method has been judged on it, never before: so no method runs while anything of its set lies on a disk.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from magsim import __version__
from magsim.benchmark.contest import Allowance, Contestant
from magsim.compensation import make
from magsim.compensation.saving import read_settings
from magsim.errors import DataError, RequestError
from magsim.generation.processes import run_all
from magsim.ladder.board import Board, make_board
from magsim.ladder.board_files import write_board
from magsim.ladder.definition import Ladder, read_ladder
from magsim.ladder.judged import SetResult, SetTask, judge_set
from magsim.ladder.results import read_set, write_set
from magsim.storage import atomic_text, atomic_write
from magsim.storage.sources import source_digest

HEAD = "ladder.json"

Announce = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """What is run.

    Attributes
    ----------
    levels, tracks : tuple of str
    sets : int
    seed : int
        Public, or hidden.
    methods, networks : tuple of Contestant
        Networks are judged on the first ``network_sets`` sets of ``network_levels`` alone.
    network_levels : tuple of str
    network_sets : int
    limits : Allowance
    command : str
        How it is made again.
    """

    levels: tuple[str, ...]
    tracks: tuple[str, ...]
    sets: int
    seed: int
    methods: tuple[Contestant, ...]
    networks: tuple[Contestant, ...]
    network_levels: tuple[str, ...]
    network_sets: int
    limits: Allowance
    command: str

    def task(self, number: int) -> SetTask:
        """Return the work of one set."""
        networks = self.networks if number < self.network_sets else ()
        return SetTask(
            number, self.seed, self.levels, self.tracks, self.methods, networks, self.network_levels, self.limits
        )


def run_ladder(
    settings: Settings, folder: Path, *, workers: int = 1, resume: bool = False, announce: Announce = lambda _line: None
) -> Board:
    """Judge methods on all sets, or go on with a run that was broken off, and write its board.

    Parameters
    ----------
    settings : Settings
    folder : Path
        New or empty; with ``resume`` the folder of the same run.
    workers : int
        Processes that fly and judge; scores do not depend on it.
    announce : callable
        Called with a line of text at each step.

    Raises
    ------
    RequestError
        If the folder holds something else or another run, or a level, a track or a method is not there.
    DataError
        If a file of the run is damaged.
    """
    ladder = read_ladder()
    head = _head(ladder, settings)
    _open(folder, head, resume=resume)
    known = {number for number in range(settings.sets) if _path(folder, number).exists()}
    missing = [number for number in range(settings.sets) if number not in known]
    if known:
        announce(f"{len(known)} of {settings.sets} sets are there already")
    tasks = [settings.task(number) for number in missing]
    for done, number in enumerate(run_all(partial(_do, folder), tasks, workers), 1):
        announce(f"set {number}: done, {done} of {len(missing)}")
    results = [read_set(_path(folder, number)) for number in range(settings.sets)]
    scores = [score for found, _ in results for score in found]
    board = make_board(head, ladder, scores, [one for _, every in results for one in every])
    write_board(board, folder)
    return board


def _head(ladder: Ladder, settings: Settings) -> dict[str, object]:
    """Return what a run is, as JSON."""
    plain: dict[str, object] = json.loads(json.dumps(asdict(settings)))
    return {
        "ladder": ladder.name,
        "ladder_sha256": ladder.sha256,
        "magsim": __version__,
        "sources": source_digest(__name__),
        **plain,
    }


def _open(folder: Path, head: Mapping[str, object], *, resume: bool) -> None:
    path = folder / HEAD
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = any(folder.iterdir())
        if resume and path.exists():
            _check(path, head)
        elif there:
            msg = f"{folder} holds files already: --resume goes on with a run of a ladder, -o names another folder"
            raise RequestError(msg)
        else:
            (folder / "sets").mkdir()
            atomic_text(path, json.dumps(head, indent=1, sort_keys=True) + "\n")
    except OSError as error:
        msg = f"cannot use the folder {folder}: {error.strerror}"
        raise RequestError(msg) from None


def _check(path: Path, head: Mapping[str, object]) -> None:
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        msg = f"{path} is damaged: {error}"
        raise DataError(msg) from None
    # the command may name another number of jobs
    keys = [key for key in head if key != "command" and (not isinstance(there, dict) or there.get(key) != head[key])]
    if keys:
        msg = f"{path} is of another run: it has other {', '.join(keys)}; -o names another folder"
        raise RequestError(msg)


def _path(folder: Path, number: int) -> Path:
    return folder / "sets" / f"set_{number:03d}.json"


def _do(folder: Path, task: SetTask) -> int:
    """Judge one set, and keep it whole: its errors first, so that a set with scores has both."""
    result = judge_set(task)
    _write_errors(_path(folder, task.number).with_suffix(".npz"), result)
    write_set(_path(folder, task.number), result.scores, result.entered)
    return task.number


def _write_errors(path: Path, result: SetResult) -> None:
    def save(temporary: Path) -> None:
        with temporary.open("wb") as file:
            np.savez_compressed(file, **result.errors)  # type: ignore[arg-type] # arrays by name

    atomic_write(path, save, force=True)


def check_entry(text: str) -> None:
    """Refuse a method that there is not, before anything is flown; a file of the user's is not run here.

    Raises
    ------
    RequestError
    """
    file = text.partition(":")[0]
    if Path(text).is_dir():
        read_settings(Path(text))
    elif file.endswith(".py"):
        if not Path(file).is_file() or ":" not in text:
            msg = f"method {text}: allowed: a file that is there and a class in it, as my_file.py:MyMethod"
            raise RequestError(msg)
    else:
        make(text)


def entries_of(names: Sequence[str], *, quick: bool) -> tuple[Contestant, ...]:
    """Return methods as they travel, named as they are typed; folders of runs by their last part."""
    entries = tuple(Contestant(name if not Path(name).is_dir() else Path(name).name, name, quick) for name in names)
    shown = [entry.name for entry in entries]
    if len(set(shown)) < len(shown):
        msg = f"two methods are called {', '.join(sorted({name for name in shown if shown.count(name) > 1}))}"
        raise RequestError(msg)
    return entries
