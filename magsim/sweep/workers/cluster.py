"""The workers of a dask cluster: one that runs already, or one that is started on this machine.

A cluster that is started here listens on the loopback interface alone, its dashboard too: by default dask's dashboard
is open to the network. Results are small; the recordings go to the file system, which all workers must share. A future
is dropped as soon as it has ended, because dask repeats a finished task whose future is held when its worker goes.
"""

import contextlib
import uuid
from collections.abc import Iterator
from concurrent.futures import CancelledError
from typing import TYPE_CHECKING, Any

from magsim.errors import DataError, MagsimError, RequestError
from magsim.sweep.shard import ShardResult, ShardTask, fly_shard
from magsim.sweep.workers.protocol import Died, Finished

if TYPE_CHECKING:
    from distributed import Client, Future

LOOPBACK = "127.0.0.1"

CONNECT_S = 30.0

LOST = "the connection to the dask scheduler was lost"

AHEAD = 2
"""Tasks for each thread of the cluster, so that none waits for the next."""

LEAST_TASKS = 16
"""Tasks that a cluster has at least, so that one that grows with its load begins to."""


def cluster_workers(scheduler: str | None, workers: int | None, *, connect_s: float = CONNECT_S) -> "ClusterWorkers":
    """Connect to a dask cluster, or start one on this machine.

    Parameters
    ----------
    scheduler : str, optional
        Address of one that runs; without it, one is started.
    workers : int, optional
        Processes of one that is started; by default one a core.

    connect_s : float [s]
        How long a running one is waited for.

    Raises
    ------
    RequestError
        If dask is not installed, both are given, or there is no scheduler at that address.
    """
    try:
        import dask
        import distributed
    except ImportError:
        msg = '--engine dask needs dask.distributed: pip install "aeromagsim[dask]"'
        raise RequestError(msg) from None
    if scheduler is not None and workers is not None:
        msg = f"--workers {workers}: the cluster at {scheduler} has its own; allowed: without --scheduler"
        raise RequestError(msg)
    if scheduler is None:
        # a killed worker is told at once: the driver knows which flight it was on
        with dask.config.set({"distributed.scheduler.allowed-failures": 0, "distributed.admin.log-length": 100}):
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host=LOOPBACK,
                dashboard_address=f"{LOOPBACK}:0",
                silence_logs="ERROR",
            )
        return ClusterWorkers(distributed.Client(cluster), cluster)
    try:
        return ClusterWorkers(distributed.Client(scheduler, timeout=connect_s, set_as_default=False))
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        msg = f"--scheduler {scheduler}: no dask scheduler answers ({reason:.200}); allowed: such as tcp://node1:8786"
        raise RequestError(msg) from None


class ClusterWorkers:
    """The workers of a dask cluster.

    Parameters
    ----------
    client : distributed.Client
        Closed with the workers.
    cluster : distributed.LocalCluster, optional
        Closed with the workers.

    Attributes
    ----------
    cluster : distributed.LocalCluster or None
        The one that was started for these workers.
    """

    def __init__(self, client: "Client", cluster: Any = None) -> None:
        self._client, self.cluster = client, cluster
        self._tasks: dict[Future, ShardTask] = {}

    @property
    def wanted(self) -> int:
        """Twice as many tasks as the cluster has threads."""
        with _connected():
            return max(AHEAD * sum(self._client.nthreads().values()), LEAST_TASKS)

    def submit(self, task: ShardTask) -> None:
        """Give a task to the scheduler."""
        key = f"shard-{task.shard}-{uuid.uuid4().hex}"
        with _connected():
            self._tasks[self._client.submit(fly_shard, task, key=key, pure=False)] = task

    def wait(self, timeout_s: float) -> list[Finished | Died]:
        """Return what has ended.

        Raises
        ------
        MagsimError
            If the file of a shard cannot be written, the sweep's files differ on a worker, or the scheduler is lost.
        """
        import distributed

        with _connected(), contextlib.suppress(TimeoutError):
            distributed.wait(list(self._tasks), timeout=timeout_s, return_when="FIRST_COMPLETED")
        out: list[Finished | Died] = []
        for future in [future for future in self._tasks if future.done()]:
            task = self._tasks.pop(future)
            out.append(_ended(future, task))
            future.release()
        return out

    def close(self, *, at_once: bool) -> None:
        """Leave the cluster; end one that was started here."""
        if at_once:
            with contextlib.suppress(Exception):  # the scheduler may be gone
                self._client.cancel(list(self._tasks), force=True)
        self._tasks.clear()
        self._client.close()
        if self.cluster is not None:
            self.cluster.close()


@contextlib.contextmanager
def _connected() -> Iterator[None]:
    """Say in one line that the scheduler is gone."""
    from distributed.client import FutureCancelledError

    try:
        yield
    except (OSError, FutureCancelledError, CancelledError) as error:
        raise DataError(LOST) from error


def _ended(future: "Future", task: ShardTask) -> Finished | Died:
    """Return how a task ended."""
    import distributed

    if future.cancelled():
        raise DataError(LOST)
    error = future.exception()
    if error is None:
        result = future.result()
        if not isinstance(result, ShardResult):
            msg = f"shard {task.shard}: the cluster answered with {type(result).__name__}"
            raise DataError(msg)
        return Finished(task, result)
    if isinstance(error, distributed.scheduler.KilledWorker):
        return Died(task)
    if isinstance(error, MagsimError):
        raise error
    msg = f"shard {task.shard}: {type(error).__name__}: {str(error)[:500]}"
    raise DataError(msg)
