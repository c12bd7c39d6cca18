"""Which rows of the calibration decide how long to train.

A whole leg held out asks for a heading that nothing has taught. Blocks of time out of all legs ask what the next
circuit will ask: the headings that were flown. They are as long as the samples are correlated, with a gap to what is
learned.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magsim.dataset import Training
from magsim.recording import Recording

BLOCK_S, PERIOD_S, FIRST_S = 32.0, 128.0, 48.0
"""Length of a block, time from block to block (no divisor of a usual leg, so that the blocks fall on other
maneuvers of each leg), and where the first begins."""

GAP_S = 6.0
"""What is neither learned nor judged on each side of a block."""


class Watched(NamedTuple):
    """Rows that judge: a recording and a mask of it."""

    recording: Recording
    rows: np.ndarray


def legs(training: Training) -> tuple[list[Recording], list[Watched]]:
    """Hold the validation rows out.

    Returns
    -------
    learned : list of Recording
        The training rows of each recording.
    watched : list of Watched
        The validation rows, in the recordings that touch them.
    """
    pairs = list(zip(training.recordings, training.valid, strict=True))
    learned = [
        recording.take(~valid) if valid.any() else recording for recording, valid in pairs if (~valid).sum() >= 2
    ]
    return learned, [Watched(recording, valid) for recording, valid in pairs if valid.any()]


def blocks(recordings: Sequence[Recording]) -> tuple[list[Recording], list[Watched]]:
    """Hold blocks of time out of recordings.

    Returns
    -------
    learned : list of Recording
        What is left of each, without blocks and gaps.
    watched : list of Watched
        The blocks.
    """
    learned, watched = [], []
    for recording in recordings:
        into = recording.time_s - recording.time_s[0] - FIRST_S
        held = (into >= 0.0) & (into % PERIOD_S < BLOCK_S)
        near = (into >= -GAP_S) & ((into + GAP_S) % PERIOD_S < BLOCK_S + 2.0 * GAP_S)
        learned.append(recording.take(~near))
        watched.append(Watched(recording, held))
    return learned, watched


def whole(recordings: Sequence[Recording]) -> list[Watched]:
    """Watch all rows of recordings."""
    return [Watched(recording, np.ones(len(recording), dtype=bool)) for recording in recordings]
