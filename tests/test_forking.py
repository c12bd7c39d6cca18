"""Processes that are forked find everything imported, run on one BLAS thread, and leave interrupts to their parent."""

import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import Connection

import pytest

from magsim import forking

HEAVY = ("h5py", "jsbsim", "numba", "scipy.signal", "magsim.sweep.shard")


def look(pipe: Connection) -> None:
    threads = [os.environ.get(name) for name in forking.BLAS_THREADS]
    pipe.send(([name for name in HEAVY if name in sys.modules], threads, signal.getsignal(signal.SIGINT)))


def test_a_forked_process_is_ready() -> None:
    if "forkserver" not in multiprocessing.get_all_start_methods():
        assert forking.begin().get_start_method() == "spawn"
        return
    handler = signal.getsignal(signal.SIGINT)
    mine, theirs = multiprocessing.Pipe()
    process = forking.begin().Process(target=look, args=(theirs,))
    process.start()
    found, threads, interrupts = mine.recv()
    process.join()
    assert found == [*HEAVY]
    assert None not in threads
    assert interrupts == signal.SIG_IGN
    assert signal.getsignal(signal.SIGINT) is handler


def test_numbers_of_threads_are_those_of_the_user_or_one(monkeypatch: pytest.MonkeyPatch) -> None:
    given, *others = forking.BLAS_THREADS
    monkeypatch.setenv(given, "3")
    for name in others:
        monkeypatch.delenv(name, raising=False)
    with forking.one_thread():
        assert [os.environ[name] for name in forking.BLAS_THREADS] == ["3", *("1" for _ in others)]
    assert [os.environ.get(name) for name in forking.BLAS_THREADS] == ["3", *(None for _ in others)]
