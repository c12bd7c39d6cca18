"""Measure the speed of random windows of a shard of many flights, on two cores.

Run ``python tests/benchmarks/window_speed.py [--json] [--flights N]``. The shard has 200 flights of 6000 rows and 24
input columns in float64 and is written first; windows of 320 rows are drawn at random in batches of 256 by two threads,
each with its own stream, into reused arrays. The file is in the cache of the system, as after the first epoch.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from magsim.recording import Recording, write_recordings
from magsim.recording.windows import Windows
from magsim.streams import stream
from tests.benchmarks.rows import at_least, finish, stated

GOAL = 40_000
ROWS, COLUMNS, WINDOW, BATCH = 6000, 24, 320, 256


def flights(count: int) -> Iterator[Recording]:
    """Flights of random numbers, one at a time."""
    rng = stream(0, "window_speed")
    time_s = np.arange(ROWS) * 0.1
    for number in range(count):
        data = {f"mag_m{i}_nt": rng.normal(size=ROWS) for i in range(COLUMNS)}
        yield Recording(f"flight_{number}", time_s, data)


def draw(windows: Windows, name: str, seconds: float) -> int:
    """Number of windows that one thread copies within the time."""
    rng, out, drawn = stream(0, name), np.empty((BATCH, WINDOW, COLUMNS)), 0
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        windows.random(BATCH, rng, out)
        drawn += BATCH
    return drawn


def main() -> None:
    """Write, open, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=3.0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shard.h5"
        start = time.perf_counter()
        write_recordings(path, flights(arguments.flights))
        written_s = time.perf_counter() - start
        start = time.perf_counter()
        windows = Windows(path, rows=WINDOW)
        opened_s = time.perf_counter() - start
        size_mb = path.stat().st_size / 1e6
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda name: draw(windows, name, 0.5), ("warm 0", "warm 1")))
            start = time.perf_counter()
            drawn = sum(pool.map(lambda name: draw(windows, name, arguments.seconds), ("0", "1")))
            rate = drawn / (time.perf_counter() - start)
        alone = draw(windows, "alone", arguments.seconds) / arguments.seconds
    finish(
        [
            stated("shard_mb", size_mb, "MB"),
            stated("write_s", written_s, "s"),
            stated("open_s", opened_s, "s"),
            stated("windows_per_s_one_thread", alone, "1/s"),
            at_least("windows_per_s", rate, "1/s", GOAL),
        ],
        as_json=arguments.json,
    )


if __name__ == "__main__":
    main()
