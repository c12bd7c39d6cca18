"""Cost against size: 10, 100 and 1000 flights on a straight line, and what a million would cost; memory beside it."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.rows import Row, at_most, stated
from tests.support.sweep_runs import run
from tests.support.sweeps import sweep_file

SIZES = (10, 100, 1000)
MILLION = 1e6


def rows() -> Sequence[Row]:
    """Fly all sizes with two workers."""
    with tempfile.TemporaryDirectory() as name:
        path = sweep_file(Path(name), flights=SIZES[0], shard=4)
        found = {
            size: run(path, Path(name) / str(size), workers=2, settings=(f"sweep.flights={size}",)) for size in SIZES
        }
    out = []
    for size, cost in found.items():
        out += [
            stated(f"wall_s_{size}", cost.wall_s, "s, two workers"),
            stated(f"cpu_s_{size}", cost.cpu_s, "s"),
            stated(f"mb_{size}", cost.bytes / 1e6, "MB"),
        ]
    last, before = found[SIZES[-1]], found[SIZES[-2]]
    each = (last.cpu_s - before.cpu_s) / (SIZES[-1] - SIZES[-2])
    growth = max(last.driver_mb - before.driver_mb, last.worker_mb - before.worker_mb)
    return [
        *out,
        stated("core_hours_of_a_million", each * MILLION / 3600.0, "h, reckoned"),
        stated("tb_of_a_million", last.bytes / SIZES[-1] * MILLION / 1e12, "TB, reckoned"),
        at_most("memory_growth_mb", growth, "MB from 100 to 1000 flights, driver or worker", 20.0),
    ]
