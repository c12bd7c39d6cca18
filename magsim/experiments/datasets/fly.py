"""The flights of a recipe, one after another or in several processes: the same recordings in the same order."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

from magsim.errors import DataError, MagsimError
from magsim.experiments.datasets.recipe import Task
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate


def fly(task: Task) -> Recording:
    """One flight under its own name.

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


def fly_all(tasks: Sequence[Task], jobs: int = 1) -> Iterator[Recording]:
    """Recordings in the order of the tasks.

    Parameters
    ----------
    tasks : sequence of Task
    jobs : int
        Processes; 1 flies in this one.

    Raises
    ------
    MagsimError
        If a flight cannot be flown.
    DataError
        If a process was killed.
    """
    if jobs <= 1 or len(tasks) <= 1:
        yield from map(fly, tasks)
        return
    others = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=context, initializer=_begin) as pool:
        waiting = [pool.submit(fly, task) for task in tasks]
        try:
            while waiting:
                # rebuilt, because arrays that come from another process can be written to
                yield replace(waiting.pop(0).result())
        except BrokenProcessPool:
            msg = "a process that flew was ended from outside; is there enough memory? --jobs 1 needs least"
            raise DataError(msg) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise


def _begin() -> None:
    """In each process: interrupts are the parent's to handle, and nobody goes on when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
