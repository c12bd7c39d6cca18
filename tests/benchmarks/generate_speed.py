"""Measure the CPU time of a whole generation, and of a bare JSBSim run of the same length in the same process.

Run ``python tests/benchmarks/generate_speed.py [--json]``. Imports, the aircraft's cached response and its cached
loop gains are excluded: one run precedes the measurement.
"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from magsim.flight import bare_run
from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.benchmarks.rows import at_most, finish, stated

GOAL = 3.0


def cpu_s(work: object) -> float:
    """CPU seconds of this process that a call takes."""
    start = time.process_time()
    work()
    return time.process_time() - start


def main() -> None:
    """Measure in turn, take medians of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--scenario", default="calibration_c208b_calm")
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()

    loaded = load_scenario(arguments.scenario)
    duration_s = float(simulate(loaded).time_s[-1])
    with tempfile.TemporaryDirectory() as folder:

        def generate() -> None:
            simulate(loaded).write(Path(folder) / "flight.h5", force=True)

        generate()
        pairs = []
        for _ in range(arguments.repeat):
            bare = cpu_s(lambda: bare_run(loaded.scenario, loaded.aircraft, duration_s))
            pairs.append((cpu_s(generate), bare))
    whole = statistics.median(pair[0] for pair in pairs)
    bare = statistics.median(pair[1] for pair in pairs)
    ratio = statistics.median(pair[0] / pair[1] for pair in pairs)
    finish(
        [
            stated("simulated_s", duration_s, "s"),
            stated("simulated_s_per_cpu_s", duration_s / whole, "1"),
            stated("bare_simulated_s_per_cpu_s", duration_s / bare, "1"),
            at_most("cpu_over_bare_jsbsim", ratio, "1", GOAL),
        ],
        as_json=arguments.json,
    )


if __name__ == "__main__":
    main()
