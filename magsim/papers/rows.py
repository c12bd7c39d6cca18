"""Recordings with other rows to learn from and to judge: papers swap their flights, or hold a heading out."""

from dataclasses import replace

import numpy as np
from scipy.signal import detrend

from magsim import columns
from magsim.recording import Recording

TRAIN, VALID, TEST = 0.0, 1.0, 2.0
"""Codes of ``columns.SPLIT``."""


def split_as(recording: Recording, split: np.ndarray | float) -> Recording:
    """Return the recording with another column ``split``: a code for all rows, or (n,) of them."""
    codes = np.broadcast_to(np.asarray(split, dtype=float), (len(recording),)).copy()
    return replace(recording, data={**recording.data, columns.SPLIT.pattern: codes})


def straight_legs(recording: Recording) -> list[np.ndarray]:
    """Return masks (n,) of the straight legs, without their turns."""
    straight = recording[columns.TURN.pattern] == 0
    found = [straight & (recording[columns.LEG.pattern] == leg) for leg in np.unique(recording[columns.LEG.pattern])]
    return [leg for leg in found if leg.sum() >= 2]


def without_trends(recording: Recording, values: np.ndarray) -> np.ndarray:
    """Return the values of all straight legs, each less its mean and its linear trend."""
    return np.concatenate([detrend(values[leg]) for leg in straight_legs(recording)])
