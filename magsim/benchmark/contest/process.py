"""The judge's side of a server: it asks for processes, and has them ended."""

import contextlib
import ctypes
import math
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from magsim.benchmark.contest import wire
from magsim.benchmark.contest.outcome import LostError
from magsim.benchmark.contest.wire import END, FORK, PID
from magsim.errors import DataError
from magsim.forking import BLAS_THREADS

PATIENCE_S = 120.0
"""How long a server may take: to import, to fork, to end processes."""

INHERITED = ("PATH", "HOME", "LANG", "MAGSIM_CACHE", "XDG_CACHE_HOME")
ARITHMETIC = ("OPENBLAS_", "MKL_", "NPY_")
"""Names, and beginnings of names, of all that a server gets of the environment: its libraries and its cache are found
by the first, and last bits are the same as here by the others."""

SETTINGS = {
    "PYTHONHASHSEED": "0",  # where sets have another order, a method may have other last bits
    "GLIBC_TUNABLES": "glibc.malloc.hugetlb=1",  # large pages: a fork is a quarter cheaper
}


class Process(NamedTuple):
    """A process that works for one method.

    Attributes
    ----------
    line : socket
    pid : int
    folder : Path
        Empty, and its own.
    """

    line: socket.socket
    pid: int
    folder: Path

    def cpu_s(self) -> float:
        """Return the processor time of all its threads so far [s], by the kernel; NaN where that does not tell."""
        clock = ctypes.c_int()
        try:
            if ctypes.CDLL(None).clock_getcpuclockid(self.pid, ctypes.byref(clock)) == 0:
                return time.clock_gettime(clock.value)
        except (AttributeError, OSError):
            pass
        return math.nan

    def peak_mb(self) -> float:
        """Return the most memory that it has held so far [MB]; NaN where the kernel does not tell."""
        try:
            peak = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{self.pid}/status").read_text(encoding="ascii"))
        except OSError:
            return math.nan
        return int(peak[1]) / 1000.0 if peak else math.nan


class Server:
    """A server of processes, started as a new program; see ``magsim.benchmark.contest.server``.

    Parameters
    ----------
    networks : bool
        It has the libraries of networks too, which make it slower to fork.
    """

    def __init__(self, *, networks: bool) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="magsim-contest-", ignore_cleanup_errors=True)
        self._line, other = socket.socketpair()
        self._line.settimeout(PATIENCE_S)
        environment = {k: v for k, v in os.environ.items() if k in INHERITED or k.startswith(ARITHMETIC)}
        environment |= {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path), **SETTINGS}
        kind = ["networks"] if networks else []
        self._program = subprocess.Popen(
            [sys.executable, "-m", "magsim.benchmark.contest.server", str(other.fileno()), *kind],
            pass_fds=[other.fileno()],
            env=environment | dict.fromkeys(BLAS_THREADS, "1"),
            cwd=self._folder.name,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        other.close()

    @property
    def is_running(self) -> bool:
        """Whether the server can be asked."""
        return self._program.poll() is None

    @property
    def pid(self) -> int:
        """Number of the server's own process."""
        return self._program.pid

    @contextlib.contextmanager
    def process(self) -> Iterator[Process]:
        """Start a process; at the end it is killed, with all that it has started, and its folder is gone."""
        with tempfile.TemporaryDirectory(dir=self._folder.name, ignore_cleanup_errors=True) as folder:
            line, other = socket.socketpair()
            with line:
                with other:
                    pid = self._asked(FORK, other.fileno())
                try:
                    yield Process(line, pid, Path(folder))
                finally:
                    self._end()

    def _end(self) -> None:
        """Have the process ended; of a server that does not answer nothing is left, and the method has lost its row."""
        try:
            self._asked(END)
        except DataError:
            self._program.kill()
            self.close()
            msg = "the server of its process has ended, or does not answer"
            raise LostError(msg, "crashed") from None

    def _asked(self, request: bytes, *handles: int) -> int:
        """Send the server a request; return the number that it answers."""
        try:
            socket.send_fds(self._line, [request], handles)
            answer = wire.exactly(self._line, PID.size, time.monotonic() + PATIENCE_S)
        except (OSError, EOFError) as error:
            msg = f"the server of methods' processes does not answer: {error}; is there enough memory?"
            raise DataError(msg) from None
        return int(PID.unpack(answer)[0])

    def close(self) -> None:
        """End the server, which ends its processes first."""
        self._line.close()
        try:
            self._program.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._program.kill()
            self._program.wait()
        self._folder.cleanup()
