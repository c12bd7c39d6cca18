"""Two workers beside one, and a sweep beside a bare loop over the same flights."""

import statistics
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.benchmarks.rows import Row, at_least, at_most, stated
from tests.support.sweep_runs import bare_loop, bare_loops, run
from tests.support.sweeps import sweep_file

FLIGHTS = 200
SHORT = 8
"""Flights of the runs whose cost is taken off: what starting up costs, however many flights follow."""

LONG = ("pattern.leg_m=75000.0", "sweep.shard=2")
"""A survey line of 1000 s, which takes some 1.5 s: as long as flights of real sweeps, two to a file as the last file of
one worker is waited for. The bare loop is compared over lines of 7 s, where a sweep adds most."""

TURNS = 3
LOOP_FLIGHTS = 104


def rows() -> Sequence[Row]:
    """Measure in turn."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = sweep_file(folder, flights=FLIGHTS, shard=4)
        run(path, folder / "warm", settings=(f"sweep.flights={SHORT}",))
        one_s = run(path, folder / "one", workers=1, settings=LONG).wall_s
        two_s = run(path, folder / "two", workers=2, settings=LONG).wall_s
        half = (*LONG, f"sweep.flights={FLIGHTS // 2}")
        (folder / "beside").mkdir()
        (folder / "alone").mkdir()
        beside_s = bare_loops(path, folder / "beside", 2, half)
        alone_s = bare_loops(path, folder / "alone", 1, half)
        swept, bare = [], []
        for turn in range(TURNS):
            swept.append(_marginal(lambda n, turn=turn: _swept(path, folder / f"s{turn}_{n}", n)))
            bare.append(_marginal(lambda n, turn=turn: _bare(path, folder / f"b{turn}_{n}", n)))
    over = 100.0 * (statistics.median(swept) / statistics.median(bare) - 1.0)
    return [
        at_least("two_workers_over_one", one_s / two_s, "1", 1.9),
        stated("two_bare_loops_over_one", 2.0 * alone_s / beside_s, "1: what the machine's two cores give"),
        at_most("overhead_over_bare_loop_pct", over, "% of processor time", 2.0),
        stated("flight_in_sweep_s", statistics.median(swept), "s of processor time"),
        stated("flight_in_bare_loop_s", statistics.median(bare), "s of processor time"),
    ]


def _marginal(cost: Callable[[int], float]) -> float:
    """Return the cost of one more flight, without that of starting up."""
    return (cost(LOOP_FLIGHTS) - cost(SHORT)) / (LOOP_FLIGHTS - SHORT)


def _swept(path: Path, folder: Path, flights: int) -> float:
    return run(path, folder, settings=(f"sweep.flights={flights}",)).cpu_s


def _bare(path: Path, folder: Path, flights: int) -> float:
    return bare_loop(path, folder, (f"sweep.flights={flights}",))[1]
