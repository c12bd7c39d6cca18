"""What is fitted and scored once, and read by several subjects: every level with one and with two training flights."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tests.benchmarks.physics_rows import sets
from tests.benchmarks.physics_rows.scoring import (
    AUXILIARY,
    CALIBRATED,
    NO_LOOKAHEAD,
    OURS,
    PEER,
    PLAIN,
    UNLABELED,
    WHOLE,
    Score,
    fitted,
    score,
)

Scores = Mapping[str, list[Score]]
"""By method, one of each set."""

ONE_FLIGHT = (PEER, WHOLE, OURS, NO_LOOKAHEAD, PLAIN, CALIBRATED, AUXILIARY)
TWO_FLIGHTS = (OURS, UNLABELED)


def tell(line: str) -> None:
    """Say what is being done, apart from the rows."""
    sys.stderr.write(line + "\n")


@dataclass
class Shown:
    """Sets of flights that are shown, and the scores on them.

    Attributes
    ----------
    folder : Path
        Holds ``levels`` and a folder of each honest world; they are flown into it where they are missing.
    draw : Draw
        All its sets are flown.
    count : int
        The first sets, which are scored.
    """

    folder: Path
    draw: sets.Draw
    count: int
    _scores: dict[tuple[str, int], Scores] = field(default_factory=dict)
    _flown: dict[str, Path] = field(default_factory=dict)

    def one(self, level: str) -> Scores:
        """Return the scores after one training flight; the methods of a set are fitted in turn, side by side."""
        return self._level(level, ONE_FLIGHT, 1)

    def two(self, level: str) -> Scores:
        """Return the scores after two training flights."""
        return self._level(level, TWO_FLIGHTS, 2)

    def levels(self) -> Path:
        """Return the folder of the levels, flown."""
        return self._fly("levels", lambda folder: sets.fly_levels(folder, self.draw, tell))

    def world(self, name: str) -> Path:
        """Return the folder of an honest world, flown."""
        return self._fly(name, lambda folder: sets.fly_world(folder, name, self.draw, tell))

    def _fly(self, name: str, fly: Callable[[Path], Path]) -> Path:
        if name not in self._flown:
            self._flown[name] = fly(self.folder / name)
        return self._flown[name]

    def _level(self, level: str, methods: tuple[str, ...], flights: int) -> Scores:
        key = (level, flights)
        if key not in self._scores:
            tell(f"level {level}, {flights} training flights")
            found: dict[str, list[Score]] = {name: [] for name in methods}
            for triple in sets.sets(self.levels(), level, self.count):
                for name in methods:
                    method, fit_s = fitted(name, triple[:flights])
                    covered = name == OURS and flights == 1
                    found[name].append(score(method, triple.test, fit_s, covered=covered))
            self._scores[key] = found
        return self._scores[key]
