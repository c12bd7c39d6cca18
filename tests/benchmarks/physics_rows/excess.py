"""What ours leaves beyond the noise floor on each level: one training flight, two, and two without labels.

The variants for whole flights and without look-ahead are stated beside it.
"""

import statistics
from collections.abc import Sequence

from tests.benchmarks.physics_rows.scoring import NO_LOOKAHEAD, OURS, UNLABELED, WHOLE, Score
from tests.benchmarks.physics_rows.sets import LEVELS
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, at_most, stated

ONE = {"0": 2.5, "1": 2.5, "2": 2.5, "3": 2.5, "4": 10.0, "5": 2.5, "6": 15.0}
TWO = {"4": 4.0, "6": 5.0}
UNLABELED_TWO = {"0": 4.0, "1": 4.0, "2": 4.0, "3": 12.0, "4": 6.0, "5": 4.0, "6": 35.0}


def rows(shown: Shown) -> Sequence[Row]:
    """Score every level."""
    out = []
    for level in LEVELS:
        one, two = shown.one(level), shown.two(level)
        out += [
            _row(f"ours_excess_pt_level_{level}", one[OURS], ONE.get(level)),
            _row(f"ours_excess_pt_two_flights_level_{level}", two[OURS], TWO.get(level)),
            _row(f"ours_excess_pt_unlabeled_two_flights_level_{level}", two[UNLABELED], UNLABELED_TWO.get(level)),
            _row(f"ours_excess_pt_whole_level_{level}", one[WHOLE], None),
            _row(f"ours_excess_pt_no_lookahead_level_{level}", one[NO_LOOKAHEAD], None),
        ]
    return out


def _row(name: str, scores: Sequence[Score], bound: float | None) -> Row:
    excesses = [one.excess_pt for one in scores]
    unit = f"pT, median of {len(excesses)} sets, {min(excesses):.3g} .. {max(excesses):.3g}"
    middle = statistics.median(excesses)
    return stated(name, middle, unit) if bound is None else at_most(name, middle, unit, bound)
