"""What a run of a ladder finds: a row for each score, and a row for each method that was entered."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from magsim.errors import DataError
from magsim.storage import atomic_text

FORMAT = 1

WHOLE = "all"
"""All flights of a set together."""


class Score(NamedTuple):
    """One score of one method on one set.

    ``flight`` is ``all`` for all flights of the set together; ``segment`` is ``test`` for all rows, a heading, or a
    maneuver.
    """

    track: str
    level: str
    set: int
    sensor: str
    method: str
    flight: str
    segment: str
    metric: str
    value: float


class Entered(NamedTuple):
    """What became of one method on one set; see ``magsim.benchmark.contest`` for the words."""

    track: str
    level: str
    set: int
    sensor: str
    method: str
    status: str
    reason: str
    adapts: bool
    pretrained: bool
    requires: tuple[str, ...]
    learned: tuple[str, ...]
    fit_cpu_s: float
    fit_wall_s: float
    estimate_us: float
    peak_mb: float
    state_bytes: float
    parameters: float


def write_set(path: Path, scores: Sequence[Score], entered: Sequence[Entered]) -> None:
    """Write what was found on one set, whole or not at all."""
    table = {
        "format": FORMAT,
        "scores": {"columns": Score._fields, "rows": [[*map(plain, row)] for row in scores]},
        "entered": {"columns": Entered._fields, "rows": [[*map(plain, row)] for row in entered]},
    }
    atomic_text(path, json.dumps(table, allow_nan=False) + "\n", force=True)


def plain(value: object) -> object:
    """Return a value for JSON, which has neither NaN nor infinity: those become text."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def read_set(path: Path) -> tuple[list[Score], list[Entered]]:
    """Read what ``write_set`` wrote.

    Raises
    ------
    DataError
        If the file is missing or damaged.
    """
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        if table["format"] != FORMAT:
            raise ValueError
        return [_score(row) for row in table["scores"]["rows"]], [_entered(row) for row in table["entered"]["rows"]]
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        msg = (
            f"{path} is damaged ({type(error).__name__}: {error}); remove it, and its set is judged again with --resume"
        )
        raise DataError(msg) from None


def _score(row: list[Any]) -> Score:
    track, level, number, sensor, method, flight, segment, metric, value = row
    return Score(track, level, int(number), sensor, method, flight, segment, metric, float(value))


def _entered(row: Any) -> Entered:
    words, (requires, learned), numbers = row[:9], row[9:11], [float(value) for value in row[11:]]
    return Entered._make([*words, tuple(requires), tuple(learned), *numbers])
