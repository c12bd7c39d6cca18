"""Clocks of the channels: when the value of a row was taken.

The row that is tagged ``t`` holds what the instrument read at ``t - skew_s - drift_ppm 1e-6 t - jitter``. Labels and
truth stay at the tag.
"""

import numpy as np

from magsim.errors import DataError
from magsim.scenario import InstrumentClock
from magsim.streams import stream


def instants(
    clock: InstrumentClock, tag_s: np.ndarray, name: str, seed: int, span_s: tuple[float, float]
) -> np.ndarray | None:
    """Return the instants at which the rows of a channel were taken.

    Parameters
    ----------
    clock : InstrumentClock
    tag_s : (m,) [s]
        Time tags of the rows.
    name : str
        Name of the channel in the random streams: each has a jitter of its own.
    seed : int
    span_s : (first, last) [s]
        Span of the flight's record.

    Returns
    -------
    (m,) [s] or None
        None where the clock has no error: the rows are the tags.

    Raises
    ------
    DataError
        If an instant lies outside of the span.
    """
    if clock.skew_s == 0.0 and clock.jitter_s == 0.0 and clock.drift_ppm == 0.0:
        return None
    late = clock.skew_s + 1e-6 * clock.drift_ppm * tag_s
    if clock.jitter_s > 0.0:
        late = late + clock.jitter_s * stream(seed, f"{name}/jitter").standard_normal(len(tag_s))
    taken = tag_s - late
    if taken.min() < span_s[0] or taken.max() > span_s[1]:
        worst = late[np.abs(late).argmax()]
        msg = (
            f"the clock of {name} is {worst:.3f} s off, which leads out of the flight's record from {span_s[0]:.3f} to "
            f"{span_s[1]:.3f} s; allowed: a smaller skew_s or drift_ppm"
        )
        raise DataError(msg)
    return taken
