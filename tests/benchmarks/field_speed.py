"""What the field costs: composition of a flight, the aircraft's response computed and read from the cache.

Run ``python tests/benchmarks/field_speed.py [--json]``. CPU times of one thread; the composition is the median of
several runs over the shipped calibration flight with two sensors and every part on but crust and swell. What moves in
flight is a row of its own: bending, of which every part is computed at six places around each of the two mounts,
controls and suspension.
"""

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable

os.environ.setdefault("OMP_NUM_THREADS", "1")
from magsim.field import compute_field, load_response
from magsim.field.composition import parts_on
from magsim.flight import fly
from magsim.loading import load_scenario
from tests.benchmarks.rows import at_most, finish, stated

SCENARIO = "calibration_c208b_calm"
OVERRIDES = (
    "field.earth.departure.enabled=true",
    "field.electronics.enabled=true",
    "field.variation={}",
    'field.targets=[{kind="sphere",name="ore",north_m=3000.0,east_m=0.0,depth_m=100.0,radius_m=50.0,susceptibility=0.1}]',
)
"""Every part of the field on but crust, swell and what moves in flight."""

MOVING = ("field.flex.enabled=true", "field.controls.enabled=true", "field.suspension.enabled=true")


def cpu_s(work: Callable[[], object]) -> float:
    """CPU seconds of this process that a call takes."""
    start = time.process_time()
    work()
    return time.process_time() - start


def composition_us(repeat: int, *overrides: str) -> tuple[float, int]:
    """CPU time [us] for each sample and sensor, and the number of parts that were on."""
    loaded = load_scenario(SCENARIO, [*OVERRIDES, *overrides])
    scenario, aircraft = loaded.scenario, loaded.aircraft
    flight, response = fly(scenario, aircraft), load_response(aircraft)
    truth = compute_field(scenario, aircraft, flight, response)
    samples = len(truth.time_s) * len(truth.mounts)
    spent = [cpu_s(lambda: compute_field(scenario, aircraft, flight, response)) for _ in range(repeat)]
    return 1e6 * statistics.median(spent) / samples, len(parts_on(scenario))


def response_s() -> tuple[float, float]:
    """CPU time [s] of the C208B's response, computed with an empty cache and read from it."""
    aircraft = load_scenario(SCENARIO).aircraft
    with tempfile.TemporaryDirectory() as folder:
        before = os.environ.get("MAGSIM_CACHE")
        os.environ["MAGSIM_CACHE"] = folder
        try:
            computed = cpu_s(lambda: load_response(aircraft))
            kept = statistics.median(cpu_s(lambda: load_response(aircraft)) for _ in range(5))
        finally:
            if before is None:
                del os.environ["MAGSIM_CACHE"]
            else:
                os.environ["MAGSIM_CACHE"] = before
    return computed, kept


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--repeat", type=int, default=7)
    arguments = parser.parse_args()
    computed, kept = response_s()
    cost, parts = composition_us(arguments.repeat)
    moving, _ = composition_us(arguments.repeat, *MOVING)
    finish(
        [
            at_most("field_us_per_sample_sensor", cost, "us", 7.0),
            stated("moving_us_per_sample_sensor", moving - cost, "us"),
            stated("parts_on", parts, "1"),
            at_most("response_s", computed, "s", 30.0),
            at_most("response_cached_s", kept, "s", 0.2),
        ],
        as_json=arguments.json,
    )


if __name__ == "__main__":
    main()
