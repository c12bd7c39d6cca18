"""The work of a method's process: fit on what it is sent, or estimate with what a fit has left; then end."""

import os
import resource
import signal
import socket
import sys
from pathlib import Path
from typing import Any

import numpy as np

import magsim
from magsim.benchmark.contest import sandbox, wire
from magsim.benchmark.methods import named_methods
from magsim.compensation import Compensator, FitContext, saving
from magsim.compensation.base import restore
from magsim.dataset import training_rows
from magsim.errors import DataError, RequestError
from magsim.storage import cache_folder
from magsim.threads import one_blas_thread

MAX_FILE = 2**30
"""Largest file that a process may write [bytes]."""

MAX_INPUT = 2**34

CACHE = cache_folder()
"""Where compiled functions lie, by the environment of the server."""

KINDS = ((RequestError, "needs"), (DataError, "failed"))
"""What becomes of errors that a method raises to tell its user something; others are crashes."""


def work(line: socket.socket) -> None:
    """Answer one request: ``fit``, ``open`` or ``estimate``."""
    message = wire.receive(line, most=MAX_INPUT)
    order = message.header
    _settle(order)
    sent: list[memoryview | bytes] = []
    try:
        if order["kind"] == "estimate":
            method = _restored(order, message)
            wire.send(line, {"status": "ready"})
            flights = wire.receive(line, most=MAX_INPUT)
            with one_blas_thread():
                found = [method.interference(one) for one in wire.unpacked(flights.header["recordings"], flights)]
            sent = [memoryview(np.ascontiguousarray(one, dtype="<f8")).cast("B") for one in found]
            answer: wire.Header = {"status": "ok"}
        else:
            answer, sent = _fitted(order, message)
    except MemoryError:
        answer = {"status": "crashed", "reason": "MemoryError"}
    except Exception as error:
        status = next((word for kind, word in KINDS if isinstance(error, kind)), "crashed")
        name = "" if status != "crashed" else f"{type(error).__name__}: "
        answer = {"status": status, "reason": f"{name}{error}"}
    wire.send(line, answer, sent)
    line.settimeout(None)
    line.recv(1)  # the judge reads first what the process has cost


def _settle(order: wire.Header) -> None:
    """Take leave of the machine: a bare environment, one thread, a folder of its own, and no other files."""
    folder = Path(order["folder"])
    sandbox.end_with_parent(signal.SIGKILL)
    null = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(null, number)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MAX_FILE, MAX_FILE))
    os.chdir(folder)
    os.environ.clear()
    os.environ.update({"HOME": str(folder), "TMPDIR": str(folder), "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"})
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)
    packages = [Path(sys.prefix), Path(sys.base_prefix), Path(magsim.__file__).parent]
    compiled = [] if CACHE is None else [CACHE / "compiled"]
    sandbox.confine([*packages, *compiled, *map(Path, order["readable"])], folder)


def _fitted(order: wire.Header, message: wire.Message) -> tuple[wire.Header, list[memoryview | bytes]]:
    """Fit a method, or open one that was fitted elsewhere; return what it is, and its files."""
    if order["kind"] == "open":
        method = _restored(order, message)
    else:
        method = _made(order)
        flights = wire.unpacked(order["recordings"], message)
        with one_blas_thread():
            method.fit_rows(training_rows(flights, order["sensor"]), FitContext(order["seed"]))
    out = Path("fitted")
    method.save(out)
    files = {path.name: path.read_bytes() for path in sorted(out.iterdir())}
    answer: dict[str, Any] = {
        "status": "ok",
        "requires": list(method.requires),
        "adapts": bool(method.adapts),
        "lookahead_rows": method.lookahead_rows,
        "warmup_s": float(method.warmup_s),
        "parameters": _parameters(method),
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


def _restored(order: wire.Header, message: wire.Message) -> Compensator:
    """Write the files of a fitted method into this process's own folder, and load it."""
    folder = Path("given")
    folder.mkdir()
    for name, block in zip(order["files"], message.blocks, strict=True):
        (folder / name).write_bytes(block)
    settings = saving.read_settings(folder)
    if order["method"] is None:
        from magsim.compensation import create

        return restore(create(settings["method"], **settings["params"]), folder, settings)
    return restore(_made(order), folder, settings)


def _parameters(method: Compensator) -> int:
    state = method.state()
    return int(sum(np.size(values) for values in (*state.arrays.values(), *state.weights.values())))
