"""What a generation costs: beside a bare JSBSim run, beside the commit called "before", and where all is new.

Run ``python tests/benchmarks/generate_speed.py [--json] [--repeat N]``. A generation is flight, field, instruments and
the file. CPU times, in turn, medians of the ratios; imports, the aircraft's response and what is compiled are excluded,
since one generation precedes the measurement.

``cpu_over_bare_jsbsim``: over a run of the same flight model at the same rate and length, with no guidance and no
logging. ``cpu_over_before``: over the old code's generation of the same flight, each in its own process.
``all_new_over_warm``: a generation at a place, a height and a speed that were never flown over the same one again; the
loops have been calibrated at the nodes around (``magsim.flight.pilot.nodes``), as they are after the first flights of a
sweep. ``node_over_generation`` is what one more node costs.
``dressed_over_generated``: one more individual of a flight already flown, drawn, with its response, over a generation;
``read_again_over_generated``: the same flight in the same field once more, read by instruments with other errors.
"""

import argparse
import os
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from magsim.flight.model.autopilot import AXES
from magsim.flight.model.setup import PlantSetup
from magsim.flight.pilot.calibration import loop_response
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import Simulator, simulate
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


def all_new_rows(repeat: int) -> list[Row]:
    """Generations where place, height and speed are new, each beside the same one again."""
    rng, pairs = np.random.default_rng(7), []
    for corner in ((70.0, 1000.0), (70.0, 3000.0), (75.0, 1000.0), (75.0, 3000.0)):
        fly_at(0.0, 0.0, corner[1], corner[0])
    for _ in range(repeat):
        place = rng.uniform((-60.0, -180.0, 1000.0, 70.0), (60.0, 180.0, 3000.0, 75.0)).tolist()
        pairs.append((fly_at(*place), fly_at(*place)))
    before = os.environ.get("MAGSIM_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MAGSIM_CACHE"] = folder
        try:
            facts = load_scenario(SCENARIO).aircraft.facts
            node = PlantSetup(lat_rad=0.0, lon_rad=0.0, alt_m=3000.0, course=0.0, speed_mps=75.0)
            node_s = cpu_s(lambda: loop_response(facts, AXES, node))
        finally:
            if before is None:
                del os.environ["MAGSIM_CACHE"]
            else:
                os.environ["MAGSIM_CACHE"] = before
    return [
        at_most("all_new_over_warm", statistics.median(a / b for a, b in pairs), "1", 1.2),
        stated("node_over_generation", node_s / statistics.median(b for _, b in pairs), "1"),
    ]


def dressed_rows(repeat: int) -> list[Row]:
    """Individuals that were never computed, on the flight of the type, each beside a generation."""
    loaded, simulator, first = load_scenario(SCENARIO), Simulator(), int(time.time())
    with tempfile.TemporaryDirectory() as folder:

        def write(recording: Recording) -> None:
            recording.write(Path(folder) / "flight.h5", force=True)

        def dress(override: str) -> float:
            return cpu_s(lambda: write(simulator.simulate(loaded.changed([override]))))

        dress(f"individual={first}")
        ratios = []
        for k in range(1, repeat + 1):
            generated = cpu_s(lambda: write(simulate(loaded)))
            ratios.append((dress(f"individual={first + k}") / generated, generated))
        dress("sensors.seed=0")
        again = [dress(f"sensors.seed={k}") / generated for k, (_, generated) in enumerate(ratios, start=1)]
    return [
        at_most("dressed_over_generated", statistics.median(ratio for ratio, _ in ratios), "1", 0.2),
        stated("read_again_over_generated", statistics.median(again), "1"),
    ]


def fly_at(lat_deg: float, lon_deg: float, alt_m: float, speed_mps: float) -> float:
    """CPU time of a generation there [s]."""
    places = (f"start.lat_deg={lat_deg}", f"start.lon_deg={lon_deg}")
    loaded = load_scenario(SCENARIO, (*places, f"start.alt_m={alt_m}", f"start.speed_mps={speed_mps}"))
    return cpu_s(lambda: simulate(loaded))


def main() -> None:
    """Measure in turn, take medians of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--repeat", type=int, default=7, help="turns of which the medians are taken")
    arguments = parser.parse_args()
    makers = (bare_rows, before_rows, all_new_rows, dressed_rows)
    rows = [row for maker in makers for row in maker(arguments.repeat)]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
