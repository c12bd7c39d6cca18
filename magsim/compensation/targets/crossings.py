"""Target ``crossings``: beside the band, lines that cross, where the clean field agrees."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.targets.base import finite, reading
from magsim.compensation.targets.model import POSITION, model_strength, position
from magsim.compensation.targets.pairs import APART_DEG, APART_S, Pairs, Track, find_pairs
from magsim.errors import DataError
from magsim.recording import Recording

DISTANCE_M = 20.0
"""Horizontal distance of two rows of one place. Estimate: a geology of 10 nT/km makes 0.2 nT of it."""

HEIGHT_M = 20.0
"""Difference of their heights. Estimate: the main field, some 0.02 nT/m, is taken off by its model; a crust of 0.01
nT/m makes 0.2 nT of it."""

LEAST_FREE = 6
"""Fewest differences beside the drift: what the band leaves open is little more than three numbers, the permanent field
and the induced one along the course."""


@dataclass(frozen=True)
class Crossings:
    """As target ``model`` in band, with pairs of rows at one place beside it.

    Attributes
    ----------
    distance_m, height_m : float [m]
        What counts as one place.
    """

    distance_m: float = DISTANCE_M
    height_m: float = HEIGHT_M
    name: str = "crossings"
    measured: bool = True
    broadband: bool = False

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return the columns of the reading and of the position."""
        return (columns.MAG.name(sensor=sensor), *POSITION)

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the reading without the model field, (n,) [nT]; see ``Target``."""
        return reading(recording, sensor) - model_strength(recording)

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the rows in which the magnetometer reads."""
        return recording.reads(sensor)

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> Pairs:
        """Return the crossings of recordings, each with itself and with the others.

        Raises
        ------
        DataError
            If there are too few.
        """
        tracks = [Track(*position(r), r.time_s, _station_nt(r)) for r in recordings]
        pairs = find_pairs(tracks, self.distance_m, self.height_m)
        if pairs.free < LEAST_FREE:
            names = ", ".join(repr(recording.name) for recording in recordings)
            msg = (
                f"target 'crossings': {names} have {len(pairs)} crossings within {self.distance_m:g} m and "
                f"{self.height_m:g} m of height, {APART_S:g} s apart and on courses {APART_DEG:g} deg apart; allowed: "
                f"{LEAST_FREE} more than the {pairs.drift.shape[1]} numbers of the drift; tie lines, a pattern flown "
                "again the other way round, or larger crossing_m and crossing_height_m would do"
            )
            raise DataError(msg)
        return pairs


def _station_nt(recording: Recording) -> np.ndarray | None:
    """Return the reading of the first base station, (n,) [nT]; None without one."""
    stations = columns.sensors_of(recording.data, columns.BASE)
    if not stations:
        return None
    name = columns.BASE.name(sensor=stations[0])
    return finite(recording, name, name)
