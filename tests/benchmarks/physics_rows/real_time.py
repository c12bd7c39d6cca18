"""What one row costs in flight, on one thread: level 6m, which has every channel and every state."""

import statistics
import time
from collections.abc import Sequence

import numpy as np

from magsim.compensation import Compensator
from magsim.recording import Recording
from tests.benchmarks.physics_rows.scoring import NO_LOOKAHEAD, OURS, fitted
from tests.benchmarks.physics_rows.sets import sets
from tests.benchmarks.physics_rows.shown import Shown
from tests.benchmarks.rows import Row, at_most, stated

LEVEL = "6m"
TURNS = 3
PUBLISHED_US = 94.0
"""PG-TLNet's figure for one row."""


def rows(shown: Shown) -> Sequence[Row]:
    """Push a flight row by row, some times; the median of the turns counts."""
    triple = next(sets(shown.levels(), LEVEL, 1))
    ours, causal = (fitted(name, [triple.train])[0] for name in (OURS, NO_LOOKAHEAD))
    spent = {name: [] for name in (OURS, NO_LOOKAHEAD)}
    for _ in range(TURNS):
        for method in (ours, causal):
            spent[method.name].append(_row_us(method, triple.test))
    return [
        at_most("stream_us_per_row", statistics.median(spent[OURS]), "us of one core", PUBLISHED_US),
        stated("stream_no_lookahead_us_per_row", statistics.median(spent[NO_LOOKAHEAD]), "us of one core"),
        stated("stream_lookahead_rows", float(ours.lookahead_rows or 0), "rows of 0.1 s"),
    ]


def _row_us(method: Compensator, recording: Recording) -> float:
    """Return the processor time of one row [us]."""
    stream = method.stream(start_utc=str(recording.meta["start_utc"]))
    table = np.ascontiguousarray(recording.stack(stream.columns))
    began = time.process_time()
    for row in table:
        stream.push_values(row)
    stream.finish()
    return 1e6 * (time.process_time() - began) / len(table)
