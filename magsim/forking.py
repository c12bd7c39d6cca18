"""The server that processes of this machine are forked from.

It imports once what all of them need, and does so while its own parent reads and checks what is to be done. Where the
system cannot fork, processes are spawned, and import for themselves.
"""

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Iterator
from multiprocessing.context import BaseContext

PRELOADED = "magsim.sweep.workers.preloaded"
"""The module that the server imports; its parent need not have."""

BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Set to 1 for the processes: their threads would only wait for each other."""


def begin() -> BaseContext:
    """Start the server, unless it runs already; return at once what starts processes, while the server imports."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([PRELOADED])
    with one_thread(), _no_interrupts():
        forkserver.ensure_running()
    return context


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let processes that are started have one BLAS thread, where the user has not set a number."""
    added = [name for name in BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


@contextlib.contextmanager
def _no_interrupts() -> Iterator[None]:
    """Let processes that are started ignore interrupts of the terminal: their parent ends them."""
    try:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    except ValueError:  # not in the main thread
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
