"""Statistics of a data set: count, minimum, maximum, mean and standard deviation of every column, by file and split.

Sums are rounded once (``math.fsum``), so the same data give the same text everywhere.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.dataset import read_bounded
from magsim.errors import DataError
from magsim.recording import Recording

STATISTICS = "statistics.csv"
"""Name of the file."""

DIGITS = ".9g"

HEADER = ("file", "split", "column", "unit", "rows", "min", "max", "mean", "std")


@dataclass(frozen=True)
class Statistic:
    """One column in the rows of one split of one file.

    ``std`` divides by the number of rows. Angles are averaged as plain numbers.
    """

    rows: int
    least: float
    largest: float
    mean: float
    std: float


Statistics = Mapping[tuple[str, str, str], Statistic]
"""By file, split and column."""


def of_values(parts: Iterable[np.ndarray]) -> Statistic:
    """Return the statistics of all values of arrays, rounded to the digits of the table."""
    values = np.concatenate(list(parts))
    mean = math.fsum(values) / len(values)
    variance = math.fsum(np.square(values - mean)) / len(values)
    numbers = (values.min(), values.max(), mean, math.sqrt(variance))
    return Statistic(len(values), *(float(f"{number:{DIGITS}}") for number in numbers))


def of_file(name: str, recordings: Iterable[Recording]) -> dict[tuple[str, str, str], Statistic]:
    """Return the statistics of one file, in the order of splits and columns."""
    parts: dict[tuple[str, str, str], list[np.ndarray]] = {}
    for recording in recordings:
        for split in columns.SPLITS.values():
            mask = recording.mask(split=split)
            if mask.any():
                for column, values in recording.data.items():
                    parts.setdefault((name, split, column), []).append(values[mask])
    words = list(columns.SPLITS.values())
    ordered = sorted(parts, key=lambda key: words.index(key[1]))
    return {key: of_values(parts[key]) for key in ordered}


def to_text(statistics: Statistics) -> str:
    """Return the text of the file."""
    lines = [",".join(HEADER)]
    for (file, split, column), found in statistics.items():
        numbers = (found.least, found.largest, found.mean, found.std)
        cells = [
            file,
            split,
            column,
            columns.family_of(column).unit,
            str(found.rows),
            *(f"{x:{DIGITS}}" for x in numbers),
        ]
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def read(path: Path) -> dict[tuple[str, str, str], Statistic]:
    """Read the statistics beside a manifest.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is not such a file.
    """
    out = {}
    text = read_bounded(path).decode("utf-8", "replace")
    for number, row in enumerate(text.splitlines()[1:], start=2):
        try:
            file, split, column, _, count, *numbers = row.split(",")
            columns.role_of(column)
            out[file, split, column] = Statistic(int(count), *map(float, numbers))
        except (ValueError, KeyError, TypeError):
            msg = f"{path}:{number}: is not a line of statistics; allowed: {', '.join(HEADER)}"
            raise DataError(msg) from None
    return out
