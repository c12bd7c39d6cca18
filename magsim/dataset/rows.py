"""Training rows and test rows of recordings: the one place that cuts them.

Rows that touch stay joined: training and validation rows of one flight are one recording, so that filters, windows and
states with memory run through them; a test piece keeps what was flown before it.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.dataset.index import FlightInfo
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.signals import spans


@dataclass(frozen=True)
class Training:
    """Rows to learn from.

    Attributes
    ----------
    recordings : sequence of Recording
        Labeled copies (``Recording.labeled``): rows of the splits ``train`` and ``valid`` in the order of time. Where
        other rows were left out, time jumps. In memory, or each read when it is asked for (``OneByOne``).
    valid : sequence of (n,) bool
        For each recording its rows of the split ``valid``: they may guide when to stop and how large to be; a method
        without such choices may learn from them too.
    sensor : str
        Name of the scalar magnetometer.
    aircraft : sequence of int or None
        For each recording which aircraft flew, numbered from 0 as they are met: enough to hold one out, too little to
        find it again. None where a recording does not tell.
    """

    recordings: Sequence[Recording]
    valid: Sequence[np.ndarray]
    sensor: str
    aircraft: Sequence[int | None]

    @classmethod
    def whole(cls, recordings: Sequence[Recording], sensor: str) -> "Training":
        """Return all rows of recordings, none for validation: what is closed-form learns from all."""
        masks = tuple(np.zeros(len(recording), dtype=bool) for recording in recordings)
        return cls(tuple(recordings), masks, sensor, (None,) * len(masks))

    @property
    def rows(self) -> dict[str, int]:
        """Number of rows of the splits ``train`` and ``valid``."""
        valid = sum(int(mask.sum()) for mask in self.valid)
        return {"train": sum(map(len, self.valid)) - valid, "valid": valid}

    def checked(self, check: Callable[[Recording], None]) -> "Training":
        """Have every recording checked: at once, or whenever it is read."""
        for recording in self.recordings:
            check(recording)
        return self


def training_rows(recordings: Iterable[Recording], sensor: str | None = None) -> Training:
    """Take the rows to learn from.

    Parameters
    ----------
    recordings : iterable of Recording
        Of one with a column ``split`` the rows ``train`` and ``valid``, else all rows. Of an iterator no more than one
        whole recording is in memory at a time, beside the rows that are kept.
    sensor : str, optional
        The scalar magnetometer; the first one of the first recording if not given.

    Raises
    ------
    RequestError
        If there is no recording, no such magnetometer, or no training row.
    """
    kept, masks, names, learned = [], [], [], 0
    aircraft: list[int | None] = []
    numbers = Numbers()
    for recording in recordings:
        sensor = pick_sensor([recording], sensor)
        names.append(repr(recording.name))
        rows = rows_of(recording, sensor)
        if rows is not None:
            kept.append(rows.recording)
            masks.append(rows.valid)
            aircraft.append(numbers(rows.aircraft))
            learned += int((~rows.valid).sum())
    if sensor is None or not names:
        msg = "nothing to fit: no recording was given"
        raise RequestError(msg)
    if not learned:
        more = f" and {len(names) - 12} more" if len(names) > 12 else ""
        msg = f"no training rows: no row of {', '.join(names[:12])}{more} has split = train"
        raise RequestError(msg)
    return Training(tuple(kept), tuple(masks), sensor, tuple(aircraft))


class LearnedRows(NamedTuple):
    """What is learned of a recording: labeled, which of its rows are for validation, which aircraft flew."""

    recording: Recording
    valid: np.ndarray
    aircraft: tuple[str, str] | None


def rows_of(recording: Recording, sensor: str) -> LearnedRows | None:
    """Return what is learned of a recording; None without two rows.

    Raises
    ------
    RequestError
        If it has no such magnetometer.
    """
    recording.check_scalar(sensor)
    train, valid = _split(recording)
    rows = train | valid
    if rows.sum() < 2:
        return None
    mask = valid[rows]
    mask.flags.writeable = False
    about = tuple(str(recording.meta[name]) for name in ("aircraft", "individual") if name in recording.meta)
    labeled = (recording if rows.all() else recording.take(rows)).labeled()
    return LearnedRows(labeled, mask, (about[0], about[1]) if len(about) == 2 else None)


class Numbers:
    """Numbers of aircraft, from 0 as they are met."""

    def __init__(self) -> None:
        self._met: dict[tuple[str, str], int] = {}

    def __call__(self, aircraft: tuple[str, str] | None) -> int | None:
        """Return the number of a type and an individual; None where it is not known."""
        return None if aircraft is None else self._met.setdefault(aircraft, len(self._met))


def read_training(flights: Iterable[FlightInfo], sensor: str | None = None) -> Training:
    """Read the rows to learn from, one flight at a time; flights that have none are not read.

    Raises
    ------
    RequestError
        As ``training_rows``.
    DataError
        If a file is damaged.
    """
    every = tuple(flights)
    return training_rows((info.read() for info in with_rows(every) or every), sensor)


def with_rows(flights: Iterable[FlightInfo]) -> list[FlightInfo]:
    """Return the flights that have rows to learn from, as far as is known before they are read."""
    return [info for info in flights if not info.splits or {"train", "valid"} & info.splits.keys()]


def pick_sensor(recordings: Sequence[Recording], sensor: str | None = None) -> str:
    """Return the scalar magnetometer that is meant: the named one, else the first of the first recording.

    Raises
    ------
    RequestError
        If there is none.
    """
    found = sensor or next(iter(recordings[0].scalars), None)
    if found is None:
        msg = f"recording {recordings[0].name!r} has no scalar magnetometer"
        raise RequestError(msg)
    return found


def _split(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Masks of the rows ``train`` and ``valid``; without a column ``split`` all rows are ``train``."""
    if columns.SPLIT.pattern not in recording:
        return np.ones(len(recording), dtype=bool), np.zeros(len(recording), dtype=bool)
    return recording.mask(split="train"), recording.mask(split="valid")


@dataclass(frozen=True)
class JudgedPiece:
    """A stretch of a recording without a gap: test rows, and all that was flown before them.

    Attributes
    ----------
    whole : Recording
        Up to the last test row.
    judged : (n,) bool
        Test rows in which the magnetometer reads.
    reads : (n,) bool
        All rows in which it reads: a filter may not run across the others.
    """

    whole: Recording
    judged: np.ndarray
    reads: np.ndarray


def pieces_to_judge(recording: Recording, sensor: str) -> tuple[JudgedPiece, ...]:
    """Take the test rows of a recording, each stretch with its lead-in.

    Parameters
    ----------
    recording : Recording
        With a column ``split``.
    sensor : str
        The scalar magnetometer.

    Raises
    ------
    RequestError
        If the recording has no such magnetometer or no column ``split``.
    """
    recording.check_scalar(sensor)
    if columns.SPLIT.pattern not in recording:
        msg = (
            f"recording {recording.name!r} has no column 'split', which marks training and test rows; "
            "magsim import makes it with --train and --test"
        )
        raise RequestError(msg)
    reads = recording.reads(sensor)
    judged = recording.mask(split="test") & reads
    pieces = []
    for span in spans(recording.time_s):
        rows = np.flatnonzero(judged[span])
        if len(rows) >= 2:
            kept = slice(span.start, span.start + int(rows[-1]) + 1)
            pieces.append(JudgedPiece(recording.take(kept), judged[kept], reads[kept]))
    return tuple(pieces)
