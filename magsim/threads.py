"""One BLAS thread: solves on one thread and on two differ in their last bits."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@cache
def _controller() -> ThreadpoolController:
    """Return the thread pools of numpy's and scipy's BLAS; finding them takes milliseconds, so it is done once."""
    import numpy.linalg  # noqa: F401
    import scipy.linalg  # noqa: F401 - brings a BLAS of its own

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run the block on one BLAS thread, so that its bits do not depend on the number of threads."""
    controller = _controller()
    if all(pool.num_threads == 1 for pool in controller.lib_controllers if pool.user_api == "blas"):
        yield
        return
    with controller.limit(limits=1, user_api="blas"):
        yield
