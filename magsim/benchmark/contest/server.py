"""The server that methods' processes are forked from: a new program, which never holds data.

It is started as ``python -m magsim.benchmark.contest.server NUMBER``, with the number of an inherited socket. For each request it gets another socket, forks,
and answers with the number of the process, which works on that socket and ends.
"""

import contextlib
import os
import signal
import socket
import sys
from importlib import import_module
from importlib.util import find_spec

from magsim.benchmark.contest.wire import PID

PRELOADED = (
    "magsim.benchmark.methods",
    "magsim.benchmark.contest.work",
    "magsim.compensation.exact_norm",
    "magsim.compensation.recursive",
    "magsim.compensation.tolles_lawson",
    "magsim.compensation.vector_tl",
    "scipy.interpolate",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
)
"""What children need, imported once."""

NETWORKS = "magsim.compensation.networks"


def main() -> None:
    """Serve until the judge ends."""
    line = socket.socket(fileno=int(sys.argv[1]))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the judge ends it
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel buries the children
    for name in (*PRELOADED, *((NETWORKS,) if find_spec("torch") and find_spec("safetensors") else ())):
        import_module(name)
    while True:
        with contextlib.suppress(InterruptedError):
            request, handles, _, _ = socket.recv_fds(line, 1, 1)
            if not request:
                return
            child = os.fork()
            if child == 0:
                _work(line, handles[0])
            os.close(handles[0])
            line.sendall(PID.pack(child))


def _work(line: socket.socket, handle: int) -> None:
    """Work as a child, which does not return."""
    code = 1
    try:
        os.setsid()
        line.close()
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        import_module("magsim.benchmark.contest.work").work(socket.socket(fileno=handle))
        code = 0
    finally:
        os._exit(code)


if __name__ == "__main__":
    main()
