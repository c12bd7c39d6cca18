"""Work in this process or in several, with results in the order of the tasks."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import TypeVar

from magsim.errors import DataError
from magsim.forking import one_thread

AHEAD = 2
"""Tasks for each process that are begun before their turn: bounds the results that wait in memory."""

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_all(work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int = 1) -> Iterator[Result]:
    """Do tasks and yield their results in the order of the tasks.

    Parameters
    ----------
    work : callable
        Of a module, so that other processes find it.
    tasks : sequence
    jobs : int
        Processes; 1 works in this one.

    Raises
    ------
    DataError
        If a process was killed.
    """
    if jobs <= 1 or len(tasks) <= 1:
        yield from map(work, tasks)
        return
    jobs = min(jobs, len(tasks))
    others = set(multiprocessing.active_children())
    context = multiprocessing.get_context("spawn")
    # threads of several processes would wait for each other's cores
    with one_thread(), ProcessPoolExecutor(jobs, mp_context=context, initializer=_start_process) as pool:
        remaining = iter(tasks)
        try:
            waiting = deque[Future[Result]](pool.submit(work, task) for task in islice(remaining, AHEAD * jobs))
            while waiting:
                result = waiting.popleft().result()
                waiting.extend(pool.submit(work, task) for task in islice(remaining, 1))
                yield result
        except BrokenProcessPool:
            msg = "a process was killed from outside; is there enough memory? One at a time (1) needs least"
            raise DataError(msg) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise


def _start_process() -> None:
    """Leave interrupts to the parent, and end this process when the parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=end_with_parent, daemon=True).start()
