"""Where the gain comes from: better inputs to Tolles-Lawson, then the physics on the same inputs."""

from collections.abc import Sequence

from tests.benchmarks.physics_rows.intervals import geometric_mean
from tests.benchmarks.physics_rows.scoring import AUXILIARY, CALIBRATED, NO_LOOKAHEAD, OURS, PEER, PLAIN, WHOLE
from tests.benchmarks.physics_rows.sets import LEVELS
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, stated


def rows(shown: Shown) -> Sequence[Row]:
    """State the improvement ratios of every level."""
    out = []
    for level in LEVELS:
        found = shown.one(level)
        for method in (PLAIN, CALIBRATED, AUXILIARY, PEER, NO_LOOKAHEAD, OURS, WHOLE):
            mean = geometric_mean([one.ir for one in found[method]])
            out.append(stated(f"ir_{method}_level_{level}", mean.value, f"1, {mean.text}"))
        floor = geometric_mean([one.raw_nt / one.floor_nt for one in found[OURS]])
        out.append(stated(f"ir_noise_floor_level_{level}", floor.value, f"1, {floor.text}"))
    return out
