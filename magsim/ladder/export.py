"""Flights of the ladder in files, with their truth: to look at, and to make methods on."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from magsim.ladder.definition import Level, read_ladder
from magsim.ladder.flights import fly_set
from magsim.recording import write_recordings


def write_flights(folder: Path, levels: Sequence[Level], seed: int, number: int) -> Iterator[Path]:
    """Fly a set and write a file for each level, as ``magsim benchmark`` and ``magsim train`` take them.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    levels : sequence of Level
    seed, number : int
        Of the ladder, and of the set.

    Yields
    ------
    Path

    Raises
    ------
    RequestError
        If a file is there already, or cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, flights in fly_set(read_ladder(), levels, seed, number).items():
        path = folder / f"set_{number:03d}_{name}.h5"
        training = [replace(one, name=f"{one.name}_{name}") for one in flights.training]
        tests = [replace(one, name=f"{role}_{name}") for role, one in flights.tests.items()]
        write_recordings(path, [*training, *tests])
        yield path
