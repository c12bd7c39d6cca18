"""What a fit is fitted to: the noise-free interference, or the reading itself."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.dataset import Training
from magsim.errors import DataError, RequestError
from magsim.recording import Recording


@dataclass(frozen=True)
class Target:
    """A target of fits.

    Attributes
    ----------
    values : callable
        Maps a labeled recording and the name of its scalar magnetometer to (n,) [nT].
    measured : bool
        Whether it is the reading. A filter would spread what that holds in dropouts, so they are cut out first; and
        unfiltered it is nearly all Earth's field.
    """

    values: Callable[[Recording, str], np.ndarray]
    measured: bool


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
            f"recording {recording.name!r} has no label {name!r}: without truth only the self-supervised methods "
            "(tl16_measured, tl18_measured, tl16_gradient) can be fitted"
        )
        raise RequestError(msg)
    return _finite(recording, name, name)


def reading(recording: Recording, sensor: str) -> np.ndarray:
    """Return the reading of a scalar magnetometer, (n,) [nT].

    Raises
    ------
    DataError
        If it is not finite.
    """
    return _finite(recording, columns.MAG.name(sensor=sensor), f"scalar magnetometer {sensor!r}")


def _finite(recording: Recording, name: str, words: str) -> np.ndarray:
    values = recording[name]
    bad = ~np.isfinite(values)
    if bad.any():
        msg = f"recording {recording.name!r}: {words} is not finite at {recording.time_s[np.argmax(bad)]:g} s"
        raise DataError(msg)
    return values


TARGETS = {"interference": Target(interference, measured=False), "measured": Target(reading, measured=True)}
"""Targets by name."""


def rows_to_fit(target: Target, training: Training) -> Sequence[Recording]:
    """Return training and validation rows as a linear fit takes them: a closed form needs no validation.

    Raises
    ------
    DataError
        If the magnetometer reads in no row.
    """
    cut = reading_rows(training.recordings, training.sensor)
    # The band-pass would spread what the reading holds in dropouts; the label is right there too.
    return cut if target.measured else training.recordings


def reading_rows(recordings: Sequence[Recording], sensor: str) -> list[Recording]:
    """Keep the rows in which the scalar magnetometer reads: what is left of each recording is pieces with gaps between.

    Raises
    ------
    DataError
        If it reads in none of the recordings.
    """
    masks = [recording.reads(sensor) for recording in recordings]
    pairs = zip(recordings, masks, strict=True)
    kept = [r if mask.all() else r.take(mask) for r, mask in pairs if mask.sum() >= 2]
    if recordings and not kept:
        names = ", ".join(repr(recording.name) for recording in recordings)
        msg = f"scalar magnetometer {sensor!r} does not read in any row of {names} that is to be learned from"
        raise DataError(msg)
    return kept
