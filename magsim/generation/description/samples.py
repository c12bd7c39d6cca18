"""Samples of a data set, to compare the numbers of another machine without the data themselves.

``samples.csv`` has a line for each column of each flight: a digest of all its values, to compare all bits; a sum of all
rows with fixed random signs; and the values of some rows, evenly spaced from the first to the last. A column agrees
with its line if each of these rows is within the tolerance of its unit, and the sum within six times the tolerance
times the square root of the number of rows: errors of the size of the tolerance, of any sign, exceed that with a
probability below 1e-7 (Hoeffding). So the rows in between count too: a change of a single one is found if it is larger
than that bound, 0.04 nT for 4000 rows.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.dataset import read_bounded
from magsim.errors import DataError
from magsim.recording import Recording
from magsim.streams import stream

SAMPLES = "samples.csv"
"""Name of the file."""

TOLERANCES = {
    "nT": 1e-4,
    "deg": 1e-7,  # turns 50 000 nT by 9e-5 nT
    "deg/s": 1e-6,
    "m": 1e-4,
    "m/s": 1e-5,
    "m/s^2": 1e-4,
    "Pa": 1e-3,
    "N": 1e-3,
    "A": 1e-4,
    "V": 1e-4,
    "degC": 1e-4,
    "1": 0.0,
}
"""Allowed difference of a value from that of another machine, by the unit of its column."""

SIGMAS = 6.0
DIGEST_DIGITS = 16


@dataclass(frozen=True)
class ColumnSample:
    """Sample of one column of one flight.

    Attributes
    ----------
    digest : str
        Beginning of the SHA-256 of its values.
    total : float
        Sum of all rows with signs.
    values : tuple of float
        Of the rows of ``sampled_rows``.
    """

    digest: str
    total: float
    values: tuple[float, ...]


Samples = Mapping[tuple[str, str], ColumnSample]
"""By flight and column."""


def sampled_rows(rows: int, count: int) -> np.ndarray:
    """Return the numbers of the sampled rows, from the first to the last."""
    return np.unique(np.linspace(0, rows - 1, min(rows, count)).round().astype(int))


@lru_cache(maxsize=8)
def _signs(rows: int) -> np.ndarray:
    return np.where(stream(0, "dataset/signs").integers(2, size=rows) == 1, 1.0, -1.0)


def take(recording: Recording, count: int) -> Iterator[tuple[tuple[str, str], ColumnSample]]:
    """Yield the samples of every column of a flight, with the values as printed."""
    kept, signs = sampled_rows(len(recording), count), _signs(len(recording))
    for name, values in recording.data.items():
        digest = hashlib.sha256(np.ascontiguousarray(values, dtype="<f8").tobytes()).hexdigest()[:DIGEST_DIGITS]
        printed = tuple(float(_printed(name, value)) for value in values[kept].tolist())
        yield (recording.name, name), ColumnSample(digest, float(_printed(name, math.fsum(signs * values))), printed)


def tolerance(column: str) -> float:
    """Return the allowed difference of a value of a column from that of another machine."""
    return TOLERANCES[columns.family_of(column).unit]


def _printed(column: str, value: float) -> str:
    """Return a value with two digits below its tolerance; with all digits if nothing may differ."""
    allowed = tolerance(column)
    if not allowed:
        return f"{value:.17g}"
    text = f"{value:.{2 - round(math.log10(allowed))}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def to_text(samples: Samples) -> str:
    """Return the text of the file."""
    most = max(len(line.values) for line in samples.values())
    lines = [",".join(["flight", "column", "sha256", "sum", *(f"v{i}" for i in range(1, most + 1))])]
    for (flight, column), line in samples.items():
        numbers = (_printed(column, value) for value in (line.total, *line.values))
        lines.append(",".join([flight, column, line.digest, *numbers]))
    return "\n".join(lines) + "\n"


def read(path: Path) -> dict[tuple[str, str], ColumnSample]:
    """Read the samples beside a manifest.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is not such a file.
    """
    out: dict[tuple[str, str], ColumnSample] = {}
    text = read_bounded(path).decode("utf-8", "replace")
    for number, row in enumerate(text.splitlines()[1:], start=2):
        try:
            flight, column, digest, total, *values = row.split(",")
            columns.role_of(column)
            out[flight, column] = ColumnSample(digest, float(total), tuple(float(value) for value in values))
        except (ValueError, KeyError):
            msg = f"{path}:{number}: is not a line of samples; allowed: flight, column, sha256, sum and values"
            raise DataError(msg) from None
    return out


def distance(column: str, one: float, other: float) -> float:
    """Return the difference of two values; that of 359.9 degrees and 0 is 0.1."""
    apart = one - other
    if columns.family_of(column).unit == "deg":
        apart = (apart + 180.0) % 360.0 - 180.0
    return abs(apart)


def sum_tolerance(column: str, rows: int) -> float:
    """Return the allowed difference of the signed sum of a column from that of another machine."""
    return SIGMAS * tolerance(column) * math.sqrt(rows)
