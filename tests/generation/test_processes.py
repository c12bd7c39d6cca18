"""Work in several processes: what they are started with, and the order of results."""

import os

import pytest

from magsim.forking import BLAS_THREADS
from magsim.generation.processes import run_all


def threads_of(number: int) -> tuple[int, list[str | None]]:
    """Return the number, and what the process was told about its threads."""
    return number, [os.environ.get(name) for name in BLAS_THREADS]


@pytest.mark.parametrize(("asked", "given"), [(None, "1"), ("3", "3")])
def test_each_of_several_processes_has_one_thread_unless_asked_otherwise(monkeypatch, asked, given):
    """Threads of processes side by side wait for each other's cores."""
    for name in BLAS_THREADS:
        monkeypatch.delenv(name, raising=False)
        if asked:
            monkeypatch.setenv(name, asked)
    before = dict(os.environ)
    assert [*run_all(threads_of, range(3), jobs=2)] == [(number, [given] * 3) for number in range(3)]
    assert dict(os.environ) == before
