"""The recorded parts of the field beside the recorded length of their sum."""

from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.recording import Recording
from tests.support import scores


class LengthOfParts(NamedTuple):
    """Length of the sum of the parts less the recorded length: largest anywhere, and STD in band on legs [nT]."""

    most_nt: float
    band_nt: float
    turning_dps: float
    """Body rate where it is largest."""


def length_of_parts(recording: Recording, sensor: str) -> LengthOfParts:
    """Compare ``total_{sensor}_nt`` with the length of the sum of the parts."""
    parts = columns.components_of(recording.data, sensor)
    names = [[columns.PART.name(component=part, sensor=sensor, axis=axis) for axis in columns.AXES] for part in parts]
    total = np.sum([recording.stack(three) for three in names], axis=0)
    off = np.linalg.norm(total, axis=1) - recording[f"total_{sensor}_nt"]
    rates = np.linalg.norm(recording.stack([f"true_rate_{axis}_dps" for axis in columns.AXES]), axis=1)
    legs = np.flatnonzero(recording["turn"] == 0)
    pieces = np.split(legs, np.flatnonzero(np.diff(legs) > 1) + 1)
    bands = [scores.band_std(off[rows], recording.rate_hz) for rows in pieces]
    worst = int(np.abs(off).argmax())
    return LengthOfParts(float(np.abs(off[worst])), float(np.sqrt(np.mean(np.square(bands)))), float(rates[worst]))
