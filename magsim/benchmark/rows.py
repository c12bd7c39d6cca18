"""Rows of a report: scores, and what methods were fitted on."""

from typing import NamedTuple


class Row(NamedTuple):
    """One score.

    ``segment`` is ``test`` for all test rows, else the straight legs of a heading (``heading 90``), a maneuver
    (``roll``), or one maneuver on one heading (``heading 90 roll``).
    """

    recording: str
    file: str
    sensor: str
    level: int | None
    seed: int
    method: str
    segment: str
    metric: str
    value: float


class Fit(NamedTuple):
    """What a method was fitted on.

    ``recordings`` are the names of the training recordings of a ``group``, ``train`` and ``valid`` their rows. A method
    that came fitted has ``given`` set and no recordings.
    """

    method: str
    group: str
    recordings: tuple[str, ...]
    train: int
    valid: int
    given: bool
