"""Sets of flights that physics methods are shown on: flown by the sweep files beside this module, and read back."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from magsim import columns, sweep
from magsim.recording import Recording, read_recordings

HERE = Path(__file__).parent
FILES = {"levels": HERE / "levels.toml"}

LEVELS = ("0", "1", "2", "3", "4", "5", "6", "0c", "1c", "7", "8", "6m")
"""Worlds of ``levels.toml`` in its order."""

TUNE_SEED, SHOW_SEED = 1401, 1402
"""Of the sets that settings are chosen on, and of those that figures come from."""

ROLES = ("train", "train2", "test")


class Triple(NamedTuple):
    """Flights of one set in one world: two to learn from, one to be judged on."""

    train: Recording
    train2: Recording
    test: Recording


def fly(folder: Path, seed: int, sets: int, *, workers: int = 1) -> Path:
    """Fly the sets of all levels into a folder, or go on where it was broken off; return the folder."""
    size = len(LEVELS) * len(ROLES)
    plan = sweep.read_sweep(FILES["levels"], [f"sweep.seed={seed}", f"sweep.flights={sets * size}"])
    sweep.fly(plan, folder, workers=workers, resume=folder.exists())
    return folder


def sets(folder: Path, level: str, count: int | None = None) -> Iterator[Triple]:
    """Yield the sets of one level, one after another, all or the first ones."""
    digit = LEVELS.index(level)
    for number, path in enumerate(sorted(folder.glob("shard_*.h5"))[:count]):
        first = number * len(LEVELS) * len(ROLES) + digit
        names = [f"f{first + role * len(LEVELS):08d}" for role in range(len(ROLES))]
        train, train2, test = read_recordings(path, names)
        yield Triple(train, train2, judged(test))


def judged(recording: Recording) -> Recording:
    """Return a recording all rows of which are for testing."""
    code = next(number for number, word in columns.SPLITS.items() if word == "test")
    return replace(recording, data={**recording.data, "split": np.full(len(recording), float(code))})
