"""Survey lines that are picked by number."""

import re
from dataclasses import dataclass

import numpy as np

from magsim.errors import RequestError

_PART = re.compile(r"(\d{1,12}(?:\.\d{1,2})?)(?:-(\d{1,12}(?:\.\d{1,2})?))?")

SHOWN = 20
"""Numbers of lines that a message lists at most."""


@dataclass(frozen=True)
class PickedLines:
    """Numbers of lines, single ones and ranges with both ends.

    PickedLines differ by hundredths: 1002.1 and 1002.10 are one.

    Attributes
    ----------
    text : str
        As it was asked for.
    ranges : tuple of (int, int)
        First and last number, in hundredths.
    """

    text: str
    ranges: tuple[tuple[int, int], ...]

    @classmethod
    def parse(cls, text: str, option: str) -> "PickedLines":
        """Read ``1001,1003-1010``.

        Raises
        ------
        RequestError
            If it is none; ``option`` is named.
        """
        ranges = []
        for part in text.split(","):
            found = _PART.fullmatch(part.strip())
            first, last = (None, None) if found is None else (found[1], found[2] or found[1])
            if first is None or last is None or float(last) < float(first):
                msg = f"{option} {text}: {part.strip()!r} is no line; allowed: numbers and ranges, as in 1001,1003-1010"
                raise RequestError(msg)
            ranges.append((round(float(first) * 100.0), round(float(last) * 100.0)))
        return cls(text, tuple(ranges))

    def __contains__(self, number: float) -> bool:
        return any(first <= round(number * 100.0) <= last for first, last in self.ranges if number == number)  # noqa: PLR0124

    def mask(self, numbers: np.ndarray) -> np.ndarray:
        """Return which rows are on these lines, (n,) bool; NaN is on none."""
        keys = np.round(numbers * 100.0)
        return np.any([(keys >= first) & (keys <= last) for first, last in self.ranges], axis=0)


def shown(numbers: np.ndarray) -> str:
    """Return the numbers of the lines of a file, for a message."""
    known = np.unique(numbers[np.isfinite(numbers)])
    text = ", ".join(f"{number:.10g}" for number in known[:SHOWN])
    return text + (f" and {len(known) - SHOWN} more" if len(known) > SHOWN else "")
