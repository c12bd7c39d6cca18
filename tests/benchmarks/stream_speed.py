"""Measure what one row costs in a stream, on one thread.

Run ``python tests/benchmarks/stream_speed.py [--json]``. The rows are those of a synthetic flight; each figure is the
median over blocks of rows, so that what else runs on the machine counts little. The bound is the figure that PG-TLNet
publishes for one row (Drones 2026, 10, 252).
"""

import argparse
import time
from collections.abc import Callable

import numpy as np

from magsim.compensation import Compensator, create
from magsim.recording import Recording
from tests.benchmarks.rows import Row, at_most, finish, stated
from tests.support.inertial import flown

GOAL_US = 94.0
BLOCK = 500
BOUNDED = ("tl16", "exact_norm")


class Mean(Compensator):
    """A method of one's own that has ``estimate`` alone, as streams take it: a short recording for each row."""

    name = "mean"
    requires = ("flux_{sensor}_{axis}_nt",)
    memory_rows = 1

    def learn(self, training, context) -> None:
        """Learn nothing."""

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return zeros, (n,)."""
        return np.zeros(len(recording))


def cost_us(push: Callable[[np.ndarray], object], rows: list) -> float:
    """Median cost of a row over blocks [us]."""
    found = []
    for begin in range(0, len(rows) - BLOCK, BLOCK):
        block = rows[begin : begin + BLOCK]
        start = time.perf_counter()
        for row in block:
            push(row)
        found.append((time.perf_counter() - start) / BLOCK * 1e6)
    return float(np.median(found))


def measured(method: Compensator, recording: Recording, count: int) -> tuple[float, float]:
    """Cost of a row as values and as a mapping [us]."""
    stream = method.stream(start_utc=recording.meta["start_utc"])
    table = np.column_stack([recording[name] for name in stream.columns])[:count]
    as_values = cost_us(stream.push_values, list(table))
    stream.finish()
    as_mapping = cost_us(stream.push, [dict(zip(stream.columns, row, strict=True)) for row in table.tolist()])
    return as_values, as_mapping


def rows_of(recording: Recording) -> list[Row]:
    """Figures of all methods."""
    methods = {
        "tl16": (create("tl16"), 12_000),
        "tl16_calibrated": (create("tl16_calibrated"), 6000),
        "tl16_auxiliary": (create("tl16_auxiliary"), 6000),
        "tl16_recursive": (create("tl16_recursive"), 6000),
        "exact_norm": (create("exact_norm"), 6000),
        "bp": (create("bp", preset="quick"), 3000),
        "own_estimate": (Mean(), 3000),
    }
    found = []
    for name, (method, count) in methods.items():
        as_values, as_mapping = measured(method.fit(recording), recording, count)
        figure = at_most(f"stream_us_per_row_{name}", as_values, "us", GOAL_US)
        found += [figure if name in BOUNDED else stated(figure.name, as_values, "us")]
        found += [stated(f"stream_us_per_row_{name}_by_name", as_mapping, "us")]
    return found


def main() -> None:
    """Fit, push, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    finish(rows_of(flown()), as_json=arguments.json)


if __name__ == "__main__":
    main()
