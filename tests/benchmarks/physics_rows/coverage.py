"""How often the 95 % intervals of ours hold the truth, in its own world; ``honest`` has the same for the others."""

import statistics
from collections.abc import Sequence

from tests.benchmarks.physics_rows.scoring import OURS
from tests.benchmarks.physics_rows.sets import LEVELS
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, at_least, stated, within


def rows(shown: Shown) -> Sequence[Row]:
    """Count rows of all levels."""
    out, every = [], []
    for level in LEVELS:
        shares = [100.0 * one.covered for one in shown.one(level)[OURS]]
        every += shares
        unit = f"%, mean of {len(shares)} flights, {min(shares):.3g} .. {max(shares):.3g}"
        out.append(stated(f"coverage_pct_level_{level}", statistics.mean(shares), unit))
    return [
        *out,
        at_least("coverage_flights", len(every), "test flights on all levels", 50),
        within("coverage_pct_own_world", statistics.mean(every), "%, mean of all flights", 90.0, 98.0),
    ]
