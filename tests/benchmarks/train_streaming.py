"""Memory of a training on flights one at a time: ten times the flights, the same memory.

Run ``python tests/benchmarks/train_streaming.py [--json] [--flights N]``. A synthetic flight of 11 minutes is written N
times under other names, as the shards of a sweep. ``magsim train`` learns from them, and from a tenth of them, each in
a process of its own, in few steps: reading, stages, disk and windows are those of long ones. Memory is the greatest
that the process had (VmHWM). Its growth must stay below a tenth of what the rows would take in memory.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from magsim.recording import Recording, write_recordings
from tests.benchmarks.rows import Row, at_most, finish, stated
from tests.support.paths import ROOT
from tests.support.worlds import World, calibration

EACH = 10
"""Flights of a shard."""

METHOD = "bp:optimizer=adam:weight_decay=0:stage_for=flight:hold_out=flights:hidden=[8]:batch=16:steps=40:every=20"

MEASURED = """
import sys
from magsim.cli import main
code = main(sys.argv[1:])
(peak,) = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
print("peak_kb", peak)
sys.exit(code)
"""


def flight() -> Recording:
    """A flight without splits, all of whose rows are learned."""
    found = calibration(World(circuits=1))
    return replace(found, data={name: values for name, values in found.data.items() if name != "split"})


def copies(numbers: range) -> Iterator[Recording]:
    """Copies of the flight under other names."""
    return (replace(flight(), name=f"f{number:05d}") for number in numbers)


def write_folder(folder: Path, count: int) -> None:
    """Write shards of copies."""
    folder.mkdir()
    for first in range(0, count, EACH):
        write_recordings(folder / f"shard_{first:06d}.h5", copies(range(first, min(first + EACH, count))))


@dataclass(frozen=True)
class Trained:
    """What a training took."""

    peak_mb: float
    seconds: float


def trained(folder: Path, run: Path, *more: str) -> Trained:
    """Train on a folder in a process of its own."""
    command = [
        sys.executable,
        "-W",
        "ignore",
        "-c",
        MEASURED,
        "train",
        METHOD,
        str(folder),
        "-o",
        str(run),
        "-q",
        *more,
    ]
    start = time.monotonic()
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    return Trained(int(done.stdout.split("peak_kb")[1]) / 1e3, time.monotonic() - start)


def in_memory_mb(count: int) -> float:
    """What the rows of so many flights take in memory."""
    rows = flight().labeled()
    return 1e-6 * count * (rows.time_s.nbytes + sum(values.nbytes for values in rows.data.values()))


def rows_of(folder: Path, count: int) -> list[Row]:
    """Write the flights, train twice, compare."""
    folders = {number: folder / f"of_{number}" for number in (count // 10, count)}
    took = {}
    for number, path in folders.items():
        write_folder(path, number)
        took[number] = trained(path, folder / f"run_{number}")
    few, many = took[count // 10], took[count]
    return [
        stated("train_flights", count, ""),
        stated("train_data_mb", in_memory_mb(count), "MB"),
        stated("train_memory_mb", many.peak_mb, "MB"),
        at_most("train_memory_growth_mb", many.peak_mb - few.peak_mb, "MB", 0.1 * in_memory_mb(count)),
        stated("train_flight_s", (many.seconds - few.seconds) / (count - count // 10), "s"),
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--flights", type=int, default=100, help="flights of the larger folder; 20 or more")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = rows_of(Path(folder), arguments.flights)
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
