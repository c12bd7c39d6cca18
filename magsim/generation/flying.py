"""Flights in this process or in several, and the files that they are written to.

Nothing here knows recipes or manifests: a task is a scenario with settings, and the recordings are the same, in the
same order, for any number of processes.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import TypeVar

from magsim.errors import MagsimError
from magsim.generation.processes import run_all
from magsim.loading import load_scenario
from magsim.recording import Recording, write_recordings
from magsim.simulation import simulate

Task = TypeVar("Task", bound="FlightTask")


@dataclass(frozen=True)
class FlightTask:
    """One flight to be flown.

    Attributes
    ----------
    name : str
        Of the flight.
    shard : str
        Name, without ending, of the file that the flight is written to.
    scenario : Path
    overrides : tuple of str
        Settings of the scenario that differ from its file, as ``key.path=value``.
    """

    name: str
    shard: str
    scenario: Path
    overrides: tuple[str, ...]


def fly(task: FlightTask) -> Recording:
    """Fly one task.

    Returns
    -------
    Recording
        With the name of the task.

    Raises
    ------
    MagsimError
        If it cannot be flown.
    """
    try:
        recording = simulate(load_scenario(task.scenario, task.overrides))
    except MagsimError as error:
        lines = "\n".join(f"flight {task.name}: {line}" for line in str(error).splitlines())
        raise type(error)(lines) from None
    return replace(recording, name=task.name)


def fly_all(tasks: Sequence[FlightTask], jobs: int = 1) -> Iterator[Recording]:
    """Fly tasks and yield their recordings in the order of the tasks.

    Parameters
    ----------
    tasks : sequence of FlightTask
    jobs : int
        Processes; 1 flies in this one.

    Yields
    ------
    Recording

    Raises
    ------
    MagsimError
        If a flight cannot be flown.
    DataError
        If a process was killed.
    """
    for recording in run_all(fly, tasks, jobs):
        # rebuilt, because arrays that come from another process can be written to
        yield replace(recording)


def write_shards(
    tasks: Sequence[Task],
    folder: Path,
    *,
    jobs: int = 1,
    check: Callable[[Task, Recording], None] = lambda _task, _recording: None,
    progress: Callable[[str], None] = lambda _line: None,
) -> None:
    """Fly tasks and write their recordings, one file for each shard.

    Parameters
    ----------
    tasks : sequence of FlightTask
        Those of one shard stand together.
    folder : Path
    jobs : int
        Processes; the files do not depend on it.
    check : callable
        Called with each task and its recording before that is written; may raise.
    progress : callable
        Called with one line after each flight.

    Raises
    ------
    MagsimError
        If a flight cannot be flown, or a file cannot be written.
    """
    recordings = _checked(tasks, jobs, check, progress)
    for shard, flights in groupby(tasks, key=lambda task: task.shard):
        count = len(list(flights))
        write_recordings(folder / f"{shard}.h5", (next(recordings) for _ in range(count)))


def _checked(
    tasks: Sequence[Task],
    jobs: int,
    check: Callable[[Task, Recording], None],
    progress: Callable[[str], None],
) -> Iterator[Recording]:
    for number, (task, recording) in enumerate(zip(tasks, fly_all(tasks, jobs), strict=True), start=1):
        check(task, recording)
        progress(f"{number}/{len(tasks)} {task.name}: {len(recording)} rows, {recording.time_s[-1]:.0f} s of flight")
        yield recording
