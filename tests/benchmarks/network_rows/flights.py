"""Flights that networks are tuned and shown on: flown by the sweeps of ``scenarios/tuning``, and read back."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from magsim import sweep
from magsim.recording import Recording, read_recordings
from tests.benchmarks.physics_rows import sets

PAPER = "000"
"""Name of paper 000's world; the other worlds are levels of the ladder."""

LEVELS = ("0", "4", "6")
"""Worlds of ``tuning/levels`` in its order."""

WORLDS = (PAPER, *LEVELS)

SWEEPS: Mapping[str, int] = {"paper_000": 1, "levels": 2 * len(LEVELS)}
"""Sweeps of ``scenarios/tuning``, and how many flights of each make a pair in all of its worlds."""


class Draw(NamedTuple):
    """Seed of the sweeps and number of pairs."""

    seed: int
    pairs: int


DRAWS: Mapping[str, Draw] = {"tune": Draw(1501, 3), "show": Draw(1502, 5)}
"""``tune``: what settings are chosen on, as the files stand; ``show``: what figures come from."""


class Judged(NamedTuple):
    """A flight to learn from, and flights to be judged on by name: their test rows count."""

    train: Recording
    tests: Mapping[str, Recording]


def fly(folder: Path, draw: Draw, report: Callable[[str], None], *, workers: int = 1) -> Path:
    """Fly the pairs of all worlds into a folder, or go on where that was broken off; return the folder.

    A finished sweep is taken as it is.
    """
    for name, size in SWEEPS.items():
        target = folder / name
        if (target / "index.parquet").exists():
            continue
        report(f"flying tuning/{name} into {target}")
        settings = [f"sweep.seed={draw.seed}", f"sweep.flights={draw.pairs * size}"]
        sweep.fly(sweep.read_sweep(f"tuning/{name}", settings), target, workers=workers, resume=target.exists())
    return folder


def pair(folder: Path, world: str, number: int) -> Judged:
    """Return a pair of one world.

    In paper 000's world it is one flight, as in the paper: circuit 1 is learned and circuit 2 judged.
    """
    path = folder / ("paper_000" if world == PAPER else "levels") / f"shard_{number:08d}.h5"
    if world == PAPER:
        (flight,) = read_recordings(path)
        return Judged(flight, {"test": flight})
    first = number * SWEEPS["levels"] + LEVELS.index(world)
    train, test = read_recordings(path, [f"f{first:08d}", f"f{first + len(LEVELS):08d}"])
    return Judged(train, {"test": sets.judged(test)})


def honest(folder: Path, world: str, number: int) -> Judged:
    """Return a set of an honest world that ``physics_methods.py`` has flown: the first circuit of a flight is learned.

    Judged are the second circuit of that flight, a flight of another day, and one of another individual.
    """
    one = _nth(sets.days(folder / world, number + 1), number)
    return Judged(one.first, {"flight": one.first, "day": one.later, "individual": one.other})


def _nth(found: Iterator[sets.Days], number: int) -> sets.Days:
    every: Sequence[sets.Days] = [*found]
    return every[number]
