"""What a generation costs: beside a bare JSBSim run, beside the commit called "before", and where all is new.

Run ``python tests/benchmarks/generate_speed.py [--json] [--repeat N]``. A generation is flight, field, instruments and
the file. CPU times, in turn, medians of the ratios; imports, the aircraft's response and what is compiled are excluded,
since one generation precedes the measurement.

``cpu_over_bare_jsbsim``: over a run of the same flight model at the same rate and length, with no guidance and no
logging. ``cpu_over_before``: over the old code's generation of the same flight, each in its own process.
"""

import argparse
import statistics
import tempfile
from pathlib import Path

from magsim.loading import load_scenario
from magsim.simulation import simulate
from tests.benchmarks.rows import Row, at_most, finish, stated
from tests.support import before
from tests.support.bare import bare_run, cpu_s
from tests.support.paths import ROOT
from tests.support.turns import taking_turns

GENERATE = """
import sys
import magsim
def work():
    magsim.simulate(loaded).write(sys.argv[2], force=True)
loaded = magsim.load_scenario(sys.argv[1])
work()
"""
"""Generate a flight; the same text for every state of the code."""

SCENARIO, OLD_NAME = "calibration_c208b_calm", "calibration_c208b"
"""A flight, and what it was called before."""


def bare_rows(repeat: int) -> list[Row]:
    """A generation and a bare run in turn."""
    loaded = load_scenario(SCENARIO)
    with tempfile.TemporaryDirectory() as folder:

        def generate() -> None:
            simulate(loaded).write(Path(folder) / "flight.h5", force=True)

        generate()
        duration_s = float(simulate(loaded).time_s[-1])
        flown_s = loaded.scenario.flight.warmup_s + duration_s
        pairs = [(cpu_s(generate), cpu_s(lambda: bare_run(loaded, flown_s))) for _ in range(repeat)]
    whole, bare = (statistics.median(pair[i] for pair in pairs) for i in (0, 1))
    return [
        stated("simulated_s", duration_s, "s"),
        stated("simulated_s_per_cpu_s", duration_s / whole, "1"),
        stated("bare_simulated_s_per_cpu_s", duration_s / bare, "1"),
        at_most("cpu_over_bare_jsbsim", statistics.median(a / b for a, b in pairs), "1", 1.4),
    ]


def before_rows(repeat: int) -> list[Row]:
    """A generation of both states of the code in turn."""
    with before.laid_out() as tree, tempfile.TemporaryDirectory() as folder:
        file = Path(folder)
        with (
            taking_turns(tree, GENERATE, [OLD_NAME, file / "old.h5"]) as old,
            taking_turns(ROOT, GENERATE, [SCENARIO, file / "new.h5"]) as new,
        ):
            pairs = [(new.cpu_s(), old.cpu_s()) for _ in range(repeat)]
    return [
        stated("generation_s", statistics.median(pair[0] for pair in pairs), "s"),
        at_most("cpu_over_before", statistics.median(a / b for a, b in pairs), "1", 0.75),
    ]


def main() -> None:
    """Measure in turn, take medians of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--repeat", type=int, default=7, help="turns of which the medians are taken")
    arguments = parser.parse_args()
    finish(bare_rows(arguments.repeat) + before_rows(arguments.repeat), as_json=arguments.json)


if __name__ == "__main__":
    main()
