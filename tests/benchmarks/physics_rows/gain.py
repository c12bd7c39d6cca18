"""What becomes of an anomaly in the reading: methods that fit beforehand must leave all of it."""

from collections.abc import Sequence

from tests.benchmarks.physics_rows.scoring import OURS, UNLABELED
from tests.benchmarks.physics_rows.sets import LEVELS
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, within


def rows(shown: Shown) -> Sequence[Row]:
    """Take the gain that is farthest from 1 on any test flight."""
    gains = {
        OURS: [one.gain for level in LEVELS for one in shown.one(level)[OURS]],
        UNLABELED: [one.gain for level in LEVELS for one in shown.two(level)[UNLABELED]],
    }
    farthest = {name: max(values, key=lambda gain: abs(gain - 1.0)) for name, values in gains.items()}
    return [within(f"gain_{name}", gain, "1, the worst flight", 0.995, 1.005) for name, gain in farthest.items()]
