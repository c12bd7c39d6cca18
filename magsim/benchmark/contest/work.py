"""The work of a method's process: fit on what it is sent, or estimate with what a fit has left; then end."""

import os
import resource
import socket
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

import magsim
from magsim.benchmark.contest import sandbox, wire
from magsim.benchmark.methods import named_methods
from magsim.compensation import Compensator, FitContext, create, saving
from magsim.compensation.base import restore
from magsim.dataset import training_rows
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.storage import cache_folder
from magsim.threads import one_blas_thread

MAX_FILE = 2**30
"""Largest file that a process may write [bytes]."""

MAX_INPUT = 2**34

CACHE = cache_folder()
"""Where compiled functions lie, by the environment of the server."""

KINDS = ((RequestError, "needs"), (DataError, "failed"))
"""What becomes of errors that a method raises to tell its user something; others are crashes."""

Answer = tuple[wire.Header, list[memoryview]]


def work(line: socket.socket) -> None:
    """Answer one order, of the kind ``fit``, ``open`` or ``estimate``: when the method is made, and what it did."""
    message = wire.receive(line, most=MAX_INPUT)
    order = message.header
    _settle(order)
    try:
        method = _made(order) if order["kind"] == "fit" else _restored(order, message.blocks)
        wire.send(line, {"status": "ready"})
        recordings = wire.receive_recordings(line, most=MAX_INPUT)
        with one_blas_thread():
            answer, blocks = _done(order, method, recordings)
    except Exception as error:
        answer, blocks = _failed(error), []
    wire.send(line, answer, blocks)
    line.recv(1)  # the judge reads first what the process has cost


def _done(order: wire.Header, method: Compensator, recordings: Sequence[Recording]) -> Answer:
    if order["kind"] == "estimate":
        found = [method.interference(one) for one in recordings]
        return {"status": "ok"}, [wire.numbers_as_bytes(one) for one in found]
    if order["kind"] == "fit":
        method.fit_rows(training_rows(recordings, order["sensor"]), FitContext(order["seed"]))
    return _described(method)


def _failed(error: Exception) -> wire.Header:
    status = next((word for kind, word in KINDS if isinstance(error, kind)), "crashed")
    name = f"{type(error).__name__}: " if status == "crashed" else ""
    return {"status": status, "reason": f"{name}{error}"}


def _settle(order: wire.Header) -> None:
    """Take leave of the machine: a bare environment, one thread, a folder of its own, and no other files."""
    folder = Path(order["folder"])
    null = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(null, number)
    os.close(null)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MAX_FILE, MAX_FILE))
    if sys.platform == "linux":  # elsewhere libraries count as data
        memory = int(order["memory_mb"] * 1e6)
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        with suppress(OSError):  # where memory is short, it is the one to go
            Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    os.chdir(folder)
    os.environ.clear()
    os.environ.update({"HOME": str(folder), "TMPDIR": str(folder), "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"})
    tempfile.tempdir = None  # it is found anew
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)
    packages = [Path(sys.prefix), Path(sys.base_prefix), Path(magsim.__file__).parent]
    compiled = [] if CACHE is None else [CACHE / "compiled"]
    sandbox.leave_shared_memory()
    sandbox.confine([*packages, *compiled, *map(Path, order["readable"])], folder)


def _described(method: Compensator) -> Answer:
    """Return what a fitted method says of itself, and its files."""
    out = Path("fitted")
    method.save(out)
    files = {path.name: memoryview(path.read_bytes()) for path in sorted(out.iterdir())}
    state = method.state()
    answer: wire.Header = {
        "status": "ok",
        "requires": list(method.requires),
        "adapts": bool(method.adapts),
        "lookahead_rows": method.lookahead_rows,
        "warmup_s": float(method.warmup_s),
        "parameters": int(sum(np.size(values) for values in (*state.arrays.values(), *state.weights.values()))),
        "sensor": method.sensor_,
        "files": list(files),
    }
    return answer, list(files.values())


def _made(order: wire.Header) -> Compensator:
    (named,), _ = named_methods([order["method"]], quick=order["quick"])
    if named.compensator is None:
        msg = f"{order['method']} is no method that can be judged"
        raise RequestError(msg)
    return named.compensator


def _restored(order: wire.Header, files: Sequence[memoryview]) -> Compensator:
    """Write the files of a fitted method into this process's own folder, and load it."""
    folder = Path("given")
    folder.mkdir()
    for name, content in zip(order["files"], files, strict=True):
        (folder / name).write_bytes(content)
    settings = saving.read_settings(folder)
    trained_elsewhere = order["method"] is None
    method = create(settings["method"], **settings["params"]) if trained_elsewhere else _made(order)
    return restore(method, folder, settings)
