"""The judge's side: what a method is sent, how long it is waited for, what is believed of its answer."""

import contextlib
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from magsim import columns
from magsim.benchmark.contest import sandbox, wire
from magsim.compensation import saving
from magsim.errors import DataError, RequestError
from magsim.forking import BLAS_THREADS
from magsim.recording import Recording

LONGEST_WARMUP_S = 60.0
MAX_STATE = 2**29
LONGEST_REASON = 300

Status = Literal["ok", "needs", "failed", "crashed", "timed_out", "not_finite", "bad_shape", "warmup"]


@dataclass(frozen=True)
class Entry:
    """A method as it travels: text alone.

    Attributes
    ----------
    name : str
        In tables.
    method : str
        A name with settings, ``my_file.py:MyMethod``, or the folder of a trained run.
    quick : bool
        Take the preset ``quick`` where there is one.
    """

    name: str
    method: str
    quick: bool = False


@dataclass(frozen=True)
class Limits:
    """How long a method may work [s]: at one fit, and at the estimates of one round."""

    fit_s: float = 600.0
    estimate_s: float = 300.0


@dataclass(frozen=True)
class Costs:
    """What a method has cost; NaN where it is not known.

    Processor time and memory are read from the kernel by the judge; ``parameters`` is the count of numbers in its state.

    Attributes
    ----------
    fit_cpu_s, fit_wall_s : float [s]
    estimate_us : float [us]
        Processor time of one row.
    peak_mb : float [MB]
        Of the fit, with Python and its libraries.
    state_bytes, parameters : float
    """

    fit_cpu_s: float = math.nan
    fit_wall_s: float = math.nan
    estimate_us: float = math.nan
    peak_mb: float = math.nan
    state_bytes: float = math.nan
    parameters: float = math.nan


@dataclass(frozen=True)
class Outcome:
    """What became of a method.

    Attributes
    ----------
    status : str
        ``ok``, or why it has no estimates. ``needs``: it says that something is missing; ``failed``: it says that the data are not enough.
    reason : str
        One line; empty where it is ok.
    estimates : tuple of tuple of (n,) [nT]
        By round and recording, in the order of the request; empty unless ok.
    requires : tuple of str
        Column families that it was given for its estimates.
    adapts : bool
        It says that it learns while it estimates.
    pretrained : bool
        It came fitted.
    learned : tuple of str
        Digests of the rows that it says it has learned, if it came fitted.
    costs : Costs
    """

    status: Status
    reason: str = ""
    estimates: tuple[tuple[np.ndarray, ...], ...] = ()
    requires: tuple[str, ...] = ()
    adapts: bool = False
    pretrained: bool = False
    learned: tuple[str, ...] = ()
    costs: Costs = Costs()


class _LostError(Exception):
    """A method has lost its row."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status: Status = status
        self.reason = reason


class Contest:
    """Runs methods in processes of their own; a context manager, which owns the server of them."""

    def __init__(self) -> None:
        sandbox.hide_memory()
        self._folder = tempfile.TemporaryDirectory(prefix="magsim-contest-")
        self._line, other = socket.socketpair()
        environment = {name: os.environ[name] for name in ("PATH", "HOME", "LANG", "MAGSIM_CACHE", "XDG_CACHE_HOME") if name in os.environ}
        environment |= dict.fromkeys(BLAS_THREADS, "1") | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        self._server = subprocess.Popen(
            [sys.executable, "-m", "magsim.benchmark.contest.server", str(other.fileno())],
            pass_fds=[other.fileno()],
            env=environment,
            cwd=self._folder.name,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        other.close()

    @property
    def sandboxed(self) -> bool:
        """Whether the kernel keeps methods from other files."""
        return sandbox.level() > 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the server, and every process with it."""
        self._line.close()
        self._server.kill()
        self._server.wait()
        self._folder.cleanup()

    def run(
        self,
        entry: Entry,
        training: Sequence[Recording],
        sensor: str,
        rounds: Sequence[Sequence[Recording]],
        limits: Limits,
        rng: np.random.Generator,
    ) -> Outcome:
        """Let a method fit, and estimate round by round, each in a process of its own.

        Parameters
        ----------
        entry : Entry
        training : sequence of Recording
            All that it may learn from.
        sensor : str
            The scalar magnetometer.
        rounds : sequence of sequence of Recording
            Blind recordings; those of one round are seen by one process.
        limits : Limits
        rng : numpy.random.Generator
            Of names, clocks and order.

        Returns
        -------
        Outcome
        """
        readable = _readable(entry)
        try:
            if Path(entry.method).is_dir():
                order, blocks, learned = _opened(Path(entry.method))
            else:
                shown = [_disguised(one, rng) for one in training]
                heads, blocks = wire.packed(shown)
                order = {"kind": "fit", "method": _absolute(entry.method), "quick": entry.quick, "sensor": sensor, "seed": 0}
                order |= {"recordings": heads}
                learned = ()
            fitted = self._fit({**order, "readable": readable}, blocks, sensor, limits)
            found, spent_s, rows = [], 0.0, 0
            for flights in rounds:
                own = {**fitted.order, "readable": readable}
                estimates, cpu_s = self._estimate(own, fitted, flights, limits, rng)
                found.append(estimates)
                spent_s, rows = spent_s + cpu_s, rows + sum(map(len, flights))
        except _LostError as lost:
            return Outcome(lost.status, lost.reason)
        costs = replace(fitted.costs, estimate_us=1e6 * spent_s / max(rows, 1))
        given = order["kind"] == "open"
        return Outcome("ok", "", tuple(found), fitted.requires, fitted.adapts, given, learned, costs)

    # ---- one process --------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def _process(self) -> Iterator[tuple[socket.socket, int, str]]:
        """Start a process; give its line, its number and its folder; end it in any case."""
        line, other = socket.socketpair()
        try:
            socket.send_fds(self._line, [b"x"], [other.fileno()])
            other.close()
            pid = wire.PID.unpack(bytes(wire.exactly(self._line, wire.PID.size, time.monotonic() + 120.0)))[0]
        except (OSError, EOFError) as error:
            line.close()
            msg = f"the server of methods' processes has ended: {error}; is there enough memory?"
            raise DataError(msg) from None
        try:
            with tempfile.TemporaryDirectory(dir=self._folder.name, ignore_cleanup_errors=True) as folder:
                yield line, pid, folder
                _end(pid)
        finally:
            _end(pid)
            line.close()

    def _fit(self, order: wire.Header, blocks: Sequence[memoryview], sensor: str, limits: Limits) -> "_Fitted":
        began = time.monotonic()
        with self._process() as (line, pid, folder):
            with _answering(began + limits.fit_s, f"a fit may take {limits.fit_s:g} s"):
                wire.send(line, {**order, "folder": folder}, blocks)
                answer = wire.receive(line, most=MAX_STATE, until=began + limits.fit_s)
            cpu_s, peak_mb = _spent(pid)
        header = _checked(answer.header)
        try:
            requires = tuple(str(one) for one in header["requires"])
            known = {family.pattern for family in columns.FAMILIES}
            files = [str(name) for name in header["files"]]
            warmup_s, parameters = float(header["warmup_s"]), float(header["parameters"])
            if not set(requires) <= known or not set(files) <= set(saving.FILES) or len(files) != len(answer.blocks):
                raise ValueError
        except (KeyError, TypeError, ValueError):
            raise _LostError("crashed", "its answer is not that of a method") from None
        if header.get("sensor") != sensor:
            raise _LostError("needs", f"it was trained for the magnetometer {str(header.get('sensor'))[:40]!r}, not {sensor!r}")
        if not 0.0 <= warmup_s <= LONGEST_WARMUP_S:
            raise _LostError("warmup", f"it declares a warm-up of {warmup_s:g} s; allowed: 0 to {LONGEST_WARMUP_S:g} s")
        costs = Costs(cpu_s, time.monotonic() - began, math.nan, peak_mb, float(sum(map(len, answer.blocks))), parameters)
        again = {"kind": "estimate", "method": order.get("method"), "quick": order.get("quick", False), "files": files}
        return _Fitted(again, answer.blocks, requires, bool(header.get("adapts")), warmup_s, costs)

    def _estimate(
        self, order: wire.Header, fitted: "_Fitted", flights: Sequence[Recording], limits: Limits, rng: np.random.Generator
    ) -> tuple[tuple[np.ndarray, ...], float]:
        """Return the estimates of a round in its order, and the processor time that they took [s]."""
        places = rng.permutation(len(flights))
        shown = [_disguised(flights[place].blind(fitted.requires), rng) for place in places]
        heads, blocks = wire.packed(shown)
        began = time.monotonic()
        until = began + limits.estimate_s
        with self._process() as (line, pid, folder):
            with _answering(until, f"the estimates of a round may take {limits.estimate_s:g} s"):
                wire.send(line, {**order, "folder": folder}, fitted.files)
                _checked(wire.receive(line, most=0, until=until).header)
                before_s, _ = _spent(pid)
                wire.send(line, {"recordings": heads}, blocks)
                answer = wire.receive(line, most=sum(8 * len(one) for one in flights), until=until)
                after_s, _ = _spent(pid)
        _checked(answer.header)
        if len(answer.blocks) != len(shown):
            raise _LostError("bad_shape", f"{len(answer.blocks)} estimates for {len(shown)} flights")
        out: list[np.ndarray | None] = [None] * len(flights)
        for number, place in enumerate(places):
            out[place] = _believed(answer, number, flights[place], fitted.warmup_s)
        return tuple(one for one in out if one is not None), after_s - before_s


@dataclass(frozen=True)
class _Fitted:
    """What a fit has left: an order for estimates, files, and what the method declares."""

    order: wire.Header
    files: tuple[memoryview, ...]
    requires: tuple[str, ...]
    adapts: bool
    warmup_s: float
    costs: Costs


@contextlib.contextmanager
def _answering(until: float, limit: str) -> Iterator[None]:
    """Turn what goes wrong while an answer is waited for into a lost row."""
    try:
        yield
    except TimeoutError:
        raise _LostError("timed_out", f"no answer in time: {limit}") from None
    except (EOFError, ConnectionError, BrokenPipeError):
        if time.monotonic() >= until:
            raise _LostError("timed_out", f"no answer in time: {limit}") from None
        raise _LostError("crashed", "its process ended without an answer") from None
    except wire.WireError as error:
        raise _LostError("crashed", str(error)) from None


def _checked(header: wire.Header) -> wire.Header:
    """Return the header of an answer; a lost row where the method has failed."""
    status = header.get("status")
    if status in ("ok", "ready"):
        return header
    plain = "".join(c if c.isprintable() else " " for c in str(header.get("reason", "")))[:LONGEST_REASON]
    known: dict[object, Status] = {"needs": "needs", "failed": "failed"}
    raise _LostError(known.get(status, "crashed"), plain or "no reason given")


def _believed(answer: wire.Message, number: int, flight: Recording, warmup_s: float) -> np.ndarray:
    """Return one estimate, checked: its length, and numbers after the declared warm-up of each piece."""
    try:
        estimate = np.array(answer.numbers(number))
    except wire.WireError as error:
        raise _LostError("bad_shape", str(error)) from None
    if len(estimate) != len(flight):
        raise _LostError("bad_shape", f"{len(estimate)} numbers for a flight of {len(flight)} rows")
    row = 0
    for piece in flight.pieces():
        own = estimate[row : row + len(piece)]
        warm = piece.time_s < piece.time_s[0] + warmup_s - 1e-9
        if not np.isfinite(own[~warm]).all():
            raise _LostError("not_finite", "its estimate is not finite after its warm-up")
        own[warm & ~np.isfinite(own)] = 0.0
        row += len(piece)
    return estimate


def _disguised(recording: Recording, rng: np.random.Generator) -> Recording:
    """Return a recording under a drawn name, with a clock that is shifted by up to a day and a date by up to ten."""
    offset_s = float(rng.integers(0, 864_000)) / 10.0
    days = int(rng.integers(-10, 11))
    name = f"flight_{rng.integers(10**9):09d}"
    meta = {key: recording.meta[key] for key in ("rate_hz",) if key in recording.meta}
    if "start_utc" in recording.meta:
        start = datetime.fromisoformat(str(recording.meta["start_utc"])) + timedelta(days=days, seconds=-offset_s)
        meta["start_utc"] = start.isoformat()
    # whole tenths again: sums with offsets differ in their last bits
    time_s = np.round(recording.time_s + offset_s, 6)
    return Recording(name, time_s, dict(recording.data), meta)


def _spent(pid: int) -> tuple[float, float]:
    """Return processor time [s] and peak memory [MB] of a process by the kernel; NaN where it does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
        peak = re.search(r"VmHWM:\s+(\d+) kB", status)
        ticks = os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError):
        return math.nan, math.nan
    return (int(fields[11]) + int(fields[12])) / ticks, int(peak[1]) / 1000.0 if peak else math.nan


def _end(pid: int) -> None:
    """Kill a process and what it has started in its group."""
    for kill in (os.killpg, os.kill):
        with contextlib.suppress(OSError):
            kill(pid, signal.SIGKILL)


def _absolute(method: str) -> str:
    """Return a method's text with the whole path of its file."""
    name, colon, rest = method.partition(":")
    return f"{Path(name).resolve()}{colon}{rest}" if name.endswith(".py") else method


def _readable(entry: Entry) -> list[str]:
    """Return what the method's process may read besides: its own file."""
    name = _absolute(entry.method).partition(":")[0]
    return [name] if name.endswith(".py") else []


def _opened(folder: Path) -> tuple[wire.Header, list[memoryview], tuple[str, ...]]:
    """Return the order that opens a trained run, its files, and the digests of the rows that it says it has learned."""
    names = [name for name in saving.FILES if (folder / name).is_file()]
    if saving.SETTINGS not in names:
        msg = f"{folder} holds no trained method: it has no {saving.SETTINGS}"
        raise RequestError(msg)
    blocks = [memoryview((folder / name).read_bytes()) for name in names]
    learned: tuple[str, ...] = ()
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        rows: list[dict[str, Any]] = json.loads((folder / "run.json").read_text(encoding="utf-8"))["rows"]
        learned = tuple(str(row.get("sha256", row.get("digest", row["recording"]))) for row in rows)
    return {"kind": "open", "method": None, "files": names}, blocks, learned
