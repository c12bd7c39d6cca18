"""Which rows of the calibration judge a network that has not learned from them.

Every fold leaves some rows out and learns from the others, so that in the end all rows have been estimated by a network
that has not seen them (cross-validation; Stone, J. R. Stat. Soc. B 36, 1974). Random windows would not do: their
neighbors would have been learned. Rows near what is left out are neither learned nor judged.
"""

from collections.abc import Hashable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from magsim import columns
from magsim.dataset import Training
from magsim.errors import RequestError
from magsim.recording import Recording

HoldOut = Literal["split", "legs", "blocks", "flights", "days", "individuals"]

BLOCK_S = 12.0
"""Length of a block: about a cycle of a maneuver, so that what is left of each maneuver still teaches it."""

GAP_S = 3.0
"""What is neither learned nor judged on each side of what is left out."""


class Watched(NamedTuple):
    """Rows that judge: a recording and a mask of it."""

    recording: Recording
    rows: np.ndarray


class Fold(NamedTuple):
    """The rows of each training recording that are learned, and the rows that judge it."""

    learned: list[np.ndarray]
    watched: list[Watched]


def folds_of(training: Training, hold_out: HoldOut, count: int) -> list[Fold]:
    """Divide training rows into folds.

    Parameters
    ----------
    training : Training
    hold_out : {"split", "legs", "blocks", "flights", "days", "individuals"}
        What is left out at once: the rows whose split is ``valid``, in a single fold, none without such rows; every
        ``count``-th leg with the turn that follows; every ``count``-th block of time; flights, days in
        UTC, or aircraft. Blocks take the place of legs in recordings that number fewer than two.
    count : int
        Folds, at most as many as there are legs, blocks, flights, days or aircraft.

    Raises
    ------
    RequestError
        If there are not two legs, blocks, flights, days or aircraft to divide, or a recording does not tell which one
        it is.
    """
    if hold_out == "split":
        return [_split(training)] if any(valid.any() for valid in training.valid) else []
    recordings = training.recordings
    if hold_out in ("legs", "blocks"):
        numbers = [_legs(r) if hold_out == "legs" else _blocks(r) for r in recordings]
    else:
        numbers = _groups(training, hold_out)
    there = len(np.unique(np.concatenate(numbers)))
    folds = min(count, there)
    if folds < 2:
        msg = f"hold_out {hold_out!r}: there are too few {hold_out} ({there}) for two folds; allowed: folds = 0, split"
        raise RequestError(msg)
    return [_fold(recordings, [each % folds == k for each in numbers]) for k in range(folds)]


def everything(training: Training) -> Fold:
    """Return the fold that learns from all rows and is judged by them."""
    rows = [np.ones(len(recording), dtype=bool) for recording in training.recordings]
    return Fold(rows, [Watched(*pair) for pair in zip(training.recordings, rows, strict=True)])


def runs(rows: np.ndarray) -> list[slice]:
    """Return the runs of rows that are marked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rows, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _split(training: Training) -> Fold:
    """Return the fold that the split names: what is learned ends where validation begins, as the data set has it."""
    pairs = list(zip(training.recordings, training.valid, strict=True))
    return Fold(
        [~valid for _, valid in pairs], [Watched(recording, valid) for recording, valid in pairs if valid.any()]
    )


def _fold(recordings: Sequence[Recording], held: Sequence[np.ndarray]) -> Fold:
    """Return a fold without the held rows and what is near them."""
    pairs = list(zip(recordings, held, strict=True))
    return Fold([~_near(r.time_s, rows) for r, rows in pairs], [Watched(r, rows) for r, rows in pairs if rows.any()])


def _near(time_s: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the rows that are held, or within ``GAP_S`` of one."""
    near = rows.copy()
    for run in runs(rows):
        near |= (time_s > time_s[run.start] - GAP_S) & (time_s < time_s[run.stop - 1] + GAP_S)
    return near


def _legs(recording: Recording) -> np.ndarray:
    """Return the number of the leg of each row, from 0; those of another circuit begin anew."""
    if columns.LEG.pattern in recording:
        found = np.unique(recording[columns.LEG.pattern], return_inverse=True)[1].reshape(-1)
        if found.max() >= 1:
            return found
    return _blocks(recording)


def _blocks(recording: Recording) -> np.ndarray:
    """Return the number of the block of each row, from 0."""
    return np.floor((recording.time_s - recording.time_s[0]) / BLOCK_S).astype(int)


def _groups(training: Training, hold_out: HoldOut) -> list[np.ndarray]:
    """Return the number of the flight, day or aircraft of each recording, from 0, for all of its rows."""
    keys = [key_of(training, number, hold_out) for number in range(len(training.recordings))]
    groups = numbered(keys, hold_out, "legs, blocks, split")
    return [np.full(len(recording), group) for recording, group in zip(training.recordings, groups, strict=True)]


def numbered(keys: Sequence[Hashable], hold_out: HoldOut, instead: str) -> list[int]:
    """Return the number of the flight, day or aircraft of each recording, from 0.

    Parameters
    ----------
    keys : sequence
        From ``key_of``.
    hold_out : {"flights", "days", "individuals"}
    instead : str
        What is allowed where all are of one, for the message.

    Raises
    ------
    RequestError
        If all are of one.
    """
    order = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    if len(order) < 2:
        msg = (
            f"hold_out {hold_out!r} needs recordings of two {hold_out} or more, and all are of one; allowed for these: "
            f"{instead}"
        )
        raise RequestError(msg)
    return [order[key] for key in keys]


def key_of(training: Training, number: int, hold_out: HoldOut) -> Hashable:
    """Return what tells the flight, day or aircraft of a recording from others.

    Raises
    ------
    RequestError
        If the recording does not tell it.
    """
    if hold_out == "flights":
        return number
    recording = training.recordings[number]
    key: Hashable = training.aircraft[number]
    wanted = "aircraft and individual"
    if hold_out == "days":
        wanted = "start_utc"
        key = str(recording.meta[wanted])[:10] if wanted in recording.meta else None
    if key is None:
        msg = f"hold_out {hold_out!r}: recording {recording.name!r} does not tell its {wanted}"
        raise RequestError(msg)
    return key
