"""The server that methods' processes are forked from: a new program, which never holds data.

It is started as ``python -m magsim.benchmark.contest.server NUMBER [networks]``, with the number of an inherited
socket. Asked to fork, it is sent another socket, on which the new process works, and answers with its number. Asked to
end, it kills that process and whatever that has started. It serves one process at a time, ends when the judge does, and
then removes the folder that it was started in.
"""

import contextlib
import gc
import os
import shutil
import signal
import socket
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from magsim.benchmark.contest import sandbox
from magsim.benchmark.contest.warming import warm
from magsim.benchmark.contest.wire import END, FORK, PID
from magsim.benchmark.contest.work import work

NETWORKS = "magsim.compensation.networks"


def main() -> None:
    """Serve until the judge ends."""
    line = socket.socket(fileno=int(sys.argv[1]))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the judge ends it
    sandbox.adopt_orphans()
    if sys.argv[2:] == ["networks"] and find_spec("torch") and find_spec("safetensors"):
        import_module(NETWORKS)
    warm()
    sandbox.leave_network()  # a process without threads alone can
    # a collection would write to every page that the processes share
    gc.collect()
    gc.freeze()
    folder, child = Path.cwd(), 0  # the judge may remove the folder first
    while True:
        request, handles, _, _ = socket.recv_fds(line, 1, 1)
        if request == FORK:
            child = os.fork()
            if child == 0:
                line.close()
                _work(socket.socket(fileno=handles[0]))
            os.close(handles[0])
            line.sendall(PID.pack(child))
        else:
            _end(child)
            child = 0
            if request != END:
                break
            line.sendall(PID.pack(child))
    shutil.rmtree(folder, ignore_errors=True)


def _work(line: socket.socket) -> None:
    """Work as a new process, which does not return."""
    try:
        os.setsid()
        sandbox.end_with_parent(signal.SIGKILL)
        work(line)
    finally:
        os._exit(0)


def _end(child: int) -> None:
    """Kill a process and all that it has started: its group, and what has left that and has become this one's child."""
    if child:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        os.kill(child, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):
        while True:
            for pid in _children():
                os.kill(pid, signal.SIGKILL)
            os.waitpid(-1, 0)


def _children() -> list[int]:
    """Return the children of this process, where the kernel tells."""
    try:
        return [int(pid) for pid in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text("ascii").split()]
    except OSError:
        return []


if __name__ == "__main__":
    main()
