"""Sweeps flown by a process of their own, and what they cost."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.support.paths import ROOT

SCRIPT = """
import json, os, resource, sys, time
from pathlib import Path
began = time.perf_counter()
path, folder, workers, engine = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
from magsim import forking
if engine == "local":
    forking.begin()  # as magsim sweep does
import psutil
from magsim import sweep as room
plan = room.read_sweep(path, sys.argv[5:])
opened = room.open_folder(plan, folder, resume=True, shared=True)
team = room.LocalWorkers(workers) if engine == "local" else room.cluster_workers(None, workers)
peak, looked = 0, 0.0
def look(_progress):
    global peak, looked
    if time.perf_counter() - looked < 5.0:  # a look costs some milliseconds
        return
    looked = time.perf_counter()
    for process in psutil.Process().children(recursive=True):
        try:
            peak = max(peak, process.memory_info().rss)
        except psutil.Error:
            pass
done = room.run(plan, opened, team, report=look)
outcome = room.finish(plan, opened)
spent = time.perf_counter() - began
own = resource.getrusage(resource.RUSAGE_SELF)
cpu = own.ru_utime + own.ru_stime + done.spent_s
print(json.dumps({
    "digest": outcome.digest, "wall_s": spent, "cpu_s": cpu, "driver_mb": own.ru_maxrss / 1024.0,
    "worker_mb": peak / 1e6, "bytes": outcome.tally.size, "flown": outcome.tally.flown,
}))
"""
"""Fly a sweep to its end, and print what it cost."""

LOOP = """
import json, sys, time
from pathlib import Path
from magsim import sweep as room
from magsim.recording import write_recordings
from magsim.simulation import Simulator
plan, folder = room.read_sweep(sys.argv[1], sys.argv[3:]), Path(sys.argv[2])
folder.mkdir()
began = time.perf_counter()
for shard in range(plan.shards):
    simulator = Simulator()
    flights = (simulator.simulate(plan.load(flight)) for flight in plan.flights(shard))
    write_recordings(folder / f"{shard}.h5", flights)
print(json.dumps({"wall_s": time.perf_counter() - began, "cpu_s": time.process_time()}))
"""
"""The bare loop: the same flights and files in one process, with nothing that a sweep adds."""


@dataclass(frozen=True)
class Run:
    """What a sweep cost: its digest, time, memory of driver and largest worker, bytes written, and flights.

    ``wall_s`` is all time from the first import on. ``cpu_s`` is that of the driver, and of the workers on their files;
    not that of their imports.
    """

    digest: str
    wall_s: float
    cpu_s: float
    driver_mb: float
    worker_mb: float
    bytes: int
    flown: int


def run(path: Path, folder: Path, *, workers: int = 1, engine: str = "local", settings: tuple[str, ...] = ()) -> Run:
    """Fly a sweep, or what is left of it."""
    return Run(**_answer(SCRIPT, path, folder, workers, engine, *settings))


def bare_loops(path: Path, folder: Path, count: int, settings: tuple[str, ...] = ()) -> float:
    """Fly the same flights in so many loops side by side, each all of them: wall time [s], without starting up."""
    commands = [[sys.executable, "-c", LOOP, str(path), str(folder / str(i)), *settings] for i in range(count)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) for command in commands]
    return max(json.loads(process.communicate()[0].splitlines()[-1])["wall_s"] for process in running)


def bare_loop(path: Path, folder: Path, settings: tuple[str, ...] = ()) -> tuple[float, float]:
    """Fly the same flights in a loop: wall and processor time [s]."""
    answer = _answer(LOOP, path, folder, *settings)
    return answer["wall_s"], answer["cpu_s"]


def _answer(script: str, *arguments: object) -> dict:
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    return json.loads(done.stdout.splitlines()[-1])
