"""Processes of this machine.

Each has a pipe of its own, so that one that dies takes no other's work with it: a pool of the standard library breaks
as a whole. They are forked from a server that has imported magsim once (``magsim.forking``). A process whose driver is
gone finishes its shard and ends.
"""

import contextlib
import signal
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess

from magsim import forking
from magsim.errors import DataError, MagsimError
from magsim.sweep.shard import ShardResult, ShardTask, fly_shard
from magsim.sweep.workers.protocol import Died, Finished


class _Worker:
    """A process and what it is doing."""

    def __init__(self, context: BaseContext) -> None:
        self.pipe, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_work, args=(theirs,), daemon=True)  # type: ignore[attr-defined]
        self.process.start()
        theirs.close()
        self.task: ShardTask | None = None

    def send(self, task: ShardTask) -> None:
        self.task = task
        with contextlib.suppress(OSError):  # it died: wait() tells
            self.pipe.send(task)


class LocalWorkers:
    """Processes of this machine.

    Parameters
    ----------
    workers : int
        How many.
    """

    def __init__(self, workers: int) -> None:
        self._context = forking.begin()
        with forking.one_thread():
            self._workers = [_Worker(self._context) for _ in range(workers)]

    @property
    def wanted(self) -> int:
        """One task for each process."""
        return len(self._workers)

    @property
    def processes(self) -> list[int]:
        """Numbers of the processes."""
        return [worker.process.pid or 0 for worker in self._workers]

    def submit(self, task: ShardTask) -> None:
        """Give a task to a process that has none."""
        next(worker for worker in self._workers if worker.task is None).send(task)

    def wait(self, timeout_s: float) -> list[Finished | Died]:
        """Return what has ended.

        Raises
        ------
        MagsimError
            If the file of a shard cannot be written, or the sweep's files have changed.
        """
        busy = {worker.pipe: worker for worker in self._workers if worker.task is not None}
        out: list[Finished | Died] = []
        for pipe in wait(list(busy), timeout_s):
            worker = busy[pipe]  # type: ignore[index]
            assert worker.task is not None
            task, worker.task = worker.task, None
            try:
                answer = worker.pipe.recv()
            except (EOFError, OSError):
                self._replace(worker)
                out.append(Died(task))
                continue
            if isinstance(answer, MagsimError):
                raise answer
            if not isinstance(answer, ShardResult):
                msg = f"shard {task.shard}: {answer}"
                raise DataError(msg)
            out.append(Finished(task, answer))
        return out

    def close(self, *, at_once: bool) -> None:
        """End the processes."""
        for worker in self._workers:
            worker.pipe.close()
            if at_once:
                worker.process.terminate()
        for worker in self._workers:
            worker.process.join()

    def _replace(self, worker: _Worker) -> None:
        """Put a new process in the place of one that died."""
        worker.pipe.close()
        worker.process.join()
        with forking.one_thread():
            self._workers[self._workers.index(worker)] = _Worker(self._context)


def _work(pipe: Connection) -> None:
    """Fly what comes until the driver is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            task = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer: object = fly_shard(task)
        except MagsimError as error:
            answer = error
        except BaseException as error:  # the driver must hear of it
            answer = f"{type(error).__name__}: {error}"
        try:
            pipe.send(answer)
        except OSError:
            return
