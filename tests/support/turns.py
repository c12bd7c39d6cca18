"""Processes that do one piece of work again and again, each when it is asked to: two states of the code in turn."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

LOOP = """
import sys, time
for line in sys.stdin:
    begun = time.process_time()
    work()
    print("took", time.process_time() - begun, flush=True)
"""
"""What follows the script of a process: its ``work`` is done and timed for each line that is read."""


class Turn:
    """A process that works when it is asked to.

    Parameters
    ----------
    process : subprocess.Popen
        Runs a script that ends with ``LOOP``.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def cpu_s(self) -> float:
        """Let it work once; return the CPU time of its process [s]."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        for line in self._process.stdout:
            if line.startswith("took "):
                return float(line.split()[1])
        msg = f"the process ended with {self._process.wait()}"
        raise RuntimeError(msg)


@contextmanager
def taking_turns(
    tree: Path, script: str, arguments: Sequence[object] = (), *, environment: Mapping[str, str] = {}
) -> Iterator[Turn]:
    """Begin a script on the code of a tree, in a process of its own and on one BLAS thread.

    Parameters
    ----------
    tree : Path
        Root of a checkout; its ``magsim`` and ``tests`` are what the script imports.
    script : str
        Defines ``work``, a function without arguments.
    arguments : sequence
        Passed on as ``sys.argv[1:]``.
    environment : mapping of str to str
        Variables that are added.

    Yields
    ------
    Turn
    """
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    env = {**os.environ, **threads, "PYTHONPATH": str(tree), **environment}
    command = [sys.executable, "-c", script + LOOP, *map(str, arguments)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=env, cwd=tree, stdin=pipe, stdout=pipe, text=True) as process:
        try:
            yield Turn(process)
        finally:
            process.stdin.close()  # the loop ends, and the process with it
