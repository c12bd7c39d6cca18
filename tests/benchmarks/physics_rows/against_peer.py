"""Ours beside the plain peer, set by set: improvement ratio, and the time of a fit.

The peer takes whole flights and looks ahead without limit; so does the variant of ours that it is set beside.
"""

from collections.abc import Sequence

from tests.benchmarks.physics_rows.intervals import geometric_mean
from tests.benchmarks.physics_rows.scoring import PEER, WHOLE
from tests.benchmarks.physics_rows.sets import LEVELS
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, at_least, at_most, stated


def rows(shown: Shown) -> Sequence[Row]:
    """Compare on every level."""
    out, ours_s, peer_s = [], 0.0, 0.0
    for level in LEVELS:
        found = shown.one(level)
        pairs = [*zip(found[WHOLE], found[PEER], strict=True)]
        mean = geometric_mean([ours.ir / peer.ir for ours, peer in pairs])
        times = geometric_mean([ours.fit_s / peer.fit_s for ours, peer in pairs])
        ours_s += sum(ours.fit_s for ours, _ in pairs)
        peer_s += sum(peer.fit_s for _, peer in pairs)
        out += [
            at_least(f"ours_over_peer_ir_lower95_level_{level}", mean.low, f"1, {mean.text}", 1.0),
            stated(f"ours_over_peer_ir_level_{level}", mean.value, "1, geometric mean"),
            stated(f"ours_fit_s_over_peer_level_{level}", times.value, f"1, {times.text}"),
        ]
    unit = f"1, all fits of one flight in turn: {ours_s:.3g} s over {peer_s:.3g} s of one core"
    return [*out, at_most("ours_fit_s_over_peer", ours_s / peer_s, unit, 0.25)]
