"""What a fit is fitted to: the label, or the reading as it is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from magsim import columns
from magsim.compensation.targets.pairs import Pairs
from magsim.dataset import Training
from magsim.errors import DataError, RequestError
from magsim.recording import Recording


class Target(Protocol):
    """A target of fits; ``learn`` reads it, ``estimate`` never does."""

    @property
    def name(self) -> str:
        """As the parameter ``target`` names it."""

    @property
    def measured(self) -> bool:
        """Whether it holds a reading: a filter would spread what that holds in dropouts, so they are cut out first."""

    @property
    def broadband(self) -> bool:
        """Whether its unfiltered values are interference, a constant and little else."""

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return the columns that are read beside those of the method's ``requires``."""

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the target of a labeled recording, (n,) [nT]; its rows must be ``known``.

        Raises
        ------
        RequestError
            If the recording lacks what is read.
        DataError
            If a value is not finite.
        """

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Mark the rows in which the target has a value, (n,) bool."""

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> Pairs | None:
        """Return pairs of rows at one place, where the clean field agrees; None for a target without such equations."""


@dataclass(frozen=True)
class Label:
    """The noise-free interference."""

    name: str = "interference"
    measured: bool = False
    broadband: bool = True

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return nothing: a missing label has a message of its own."""
        return ()

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the label; see ``interference``."""
        return interference(recording, sensor)

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return all rows: the label is right in dropouts too."""
        return np.ones(len(recording), dtype=bool)

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> None:
        """Return None."""


@dataclass(frozen=True)
class Reading:
    """The reading itself: what of the clean field lies in the band counts as interference."""

    name: str = "measured"
    measured: bool = True
    broadband: bool = False

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return the column of the scalar magnetometer."""
        return (columns.MAG.name(sensor=sensor),)

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the reading; see ``reading``."""
        return reading(recording, sensor)

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the rows in which the magnetometer reads."""
        return recording.reads(sensor)

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> Pairs | None:
        """Return None."""
        return None


def interference(recording: Recording, sensor: str) -> np.ndarray:
    """Return the noise-free interference of a training recording, (n,) [nT].

    Raises
    ------
    RequestError
        If it has no such label: a real survey has none.
    DataError
        If a label is not finite.
    """
    name = columns.INTERFERENCE.name(sensor=sensor)
    if name not in recording:
        msg = (
            f"recording {recording.name!r} has no label {name!r}: without truth a method is fitted to target "
            "'measured', 'model', 'map', 'crossings' or 'reference', as tl16_measured or tl16:target=model are"
        )
        raise RequestError(msg)
    return finite(recording, name, name)


def reading(recording: Recording, sensor: str) -> np.ndarray:
    """Return the reading of a scalar magnetometer, (n,) [nT].

    Raises
    ------
    DataError
        If it is not finite.
    """
    return finite(recording, columns.MAG.name(sensor=sensor), f"scalar magnetometer {sensor!r}")


def finite(recording: Recording, name: str, words: str) -> np.ndarray:
    """Return a column whose values must be finite, (n,).

    Raises
    ------
    DataError
        With the time of the first value that is not.
    """
    values = recording[name]
    bad = ~np.isfinite(values)
    if bad.any():
        msg = f"recording {recording.name!r}: {words} is not finite at {recording.time_s[np.argmax(bad)]:g} s"
        raise DataError(msg)
    return values


def rows_to_fit(target: Target, training: Training, owner: str) -> Sequence[Recording]:
    """Return training and validation rows as a closed form takes them, which needs no validation.

    Parameters
    ----------
    target : Target
    training : Training
    owner : str
        Name of the method, for messages.

    Raises
    ------
    RequestError
        If a recording lacks a column that the target reads.
    DataError
        If the target has a value in no row.
    """
    for recording in training.recordings:
        for name in target.reads(training.sensor):
            if name not in recording:
                msg = (
                    f"recording {recording.name!r} has no column {name}, which method {owner} reads while it learns "
                    f"from target {target.name!r}"
                )
                raise RequestError(msg)
    # The band-pass would spread what the reading holds in dropouts; the label is right there too.
    if not target.measured:
        return training.recordings
    masks = [target.known(recording, training.sensor) for recording in training.recordings]
    return kept_rows(training.recordings, masks, training.sensor)


def reading_rows(recordings: Sequence[Recording], sensor: str) -> list[Recording]:
    """Keep the rows in which the scalar magnetometer reads: what is left of each recording is pieces with gaps between.

    Raises
    ------
    DataError
        If it reads in none of the recordings.
    """
    return kept_rows(recordings, [recording.reads(sensor) for recording in recordings], sensor)


def kept_rows(recordings: Sequence[Recording], masks: Sequence[np.ndarray], sensor: str) -> list[Recording]:
    """Keep rows by masks; a recording with less than two of them is left out.

    Raises
    ------
    DataError
        If no recording is left.
    """
    pairs = zip(recordings, masks, strict=True)
    kept = [r if mask.all() else r.take(mask) for r, mask in pairs if mask.sum() >= 2]
    if recordings and not kept:
        names = ", ".join(repr(recording.name) for recording in recordings)
        msg = f"scalar magnetometer {sensor!r} does not read in any row of {names} that is to be learned from"
        raise DataError(msg)
    return kept
