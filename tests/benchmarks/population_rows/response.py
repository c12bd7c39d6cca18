"""What the response of an individual costs, and how it compares with the whole solution."""

import statistics
import time

import numpy as np

from magsim.aircraft import Vehicle, load_aircraft, load_bird
from magsim.field import AircraftResponse, compute_response, load_response
from magsim.population import individual_of
from tests.benchmarks.rows import Row, at_most, stated

FIRST, COUNT = 9001, 7
"""Individuals that no other benchmark uses, so that none is in the cache."""


def _cpu_s(vehicle: Vehicle) -> float:
    start = time.process_time()
    load_response(vehicle)
    return time.process_time() - start


def _off(fast: AircraftResponse, whole: AircraftResponse) -> float:
    """Largest relative difference of steel, moments and slow eddy currents at any mount."""
    worst = 0.0
    for name in ("induced", "permanent_nt", "eddy_slow_s", "wiring_nt_per_a"):
        one, other = (getattr(response, name).reshape(len(response.mounts), -1) for response in (fast, whole))
        worst = max(worst, float((np.linalg.norm(one - other, axis=1) / np.linalg.norm(other, axis=1)).max()))
    return worst


def rows() -> list[Row]:
    """CPU seconds with the type in the cache and the individual not, of the Cessna; both types of answer beside it."""
    cessna, run = load_aircraft("c208b"), int(time.time())
    load_response(individual_of(cessna, run))
    # The number changes with the clock: what is measured was never computed before.
    spent = [_cpu_s(individual_of(cessna, run + k)) for k in range(1, COUNT + 1)]
    out = [at_most("response_of_individual_s", statistics.median(spent), "s", 0.5)]
    for vehicle in (cessna, load_aircraft("uav"), load_aircraft("helicopter"), load_bird("bird")):
        one = individual_of(vehicle, FIRST)
        off = _off(load_response(one), compute_response(one))
        out.append(at_most(f"response_off_whole_solution_{vehicle.name}", off, "1", 1e-6))
    start = time.process_time()
    compute_response(individual_of(cessna, FIRST))
    return [*out, stated("response_by_whole_solution_s", time.process_time() - start, "s")]
