"""The same bytes with one worker and two, on a dask cluster, resumed, and in parts."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from magsim import sweep as room
from tests.benchmarks.rows import Row, at_most
from tests.support.sweep_runs import run
from tests.support.sweeps import bytes_of, sweep_file

FLIGHTS = 40


def rows() -> Sequence[Row]:
    """Count the ways of flying that end in other bytes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = sweep_file(folder, flights=FLIGHTS, shard=4)
        first = run(path, folder / "one", workers=1)
        found = {
            "two": run(path, folder / "two", workers=2).digest,
            "dask": run(path, folder / "dask", workers=2, engine="dask").digest,
            "resumed": _resumed(path, folder / "resumed"),
            "parts": _parts(path, folder / "parts"),
        }
        whole = bytes_of(folder / "one")
        differ = [way for way, digest in found.items() if digest != first.digest or bytes_of(folder / way) != whole]
    return [at_most("digests_that_differ", len(differ), "of 4 other ways to fly", 0)]


def _resumed(path: Path, folder: Path) -> str:
    """Fly the first part of three, then the rest."""
    plan = room.read_sweep(path)
    room.run(plan, room.open_folder(plan, folder), room.LocalWorkers(1), part=(1, 3))
    return run(path, folder, workers=2).digest


def _parts(path: Path, folder: Path) -> str:
    """Fly four parts, the last one first."""
    plan = room.read_sweep(path)
    for part in (4, 2, 1, 3):
        opened = room.open_folder(plan, folder, shared=True)
        room.run(plan, opened, room.LocalWorkers(1), part=(part, 4))
    outcome = room.finish(plan, opened)
    assert outcome is not None
    return outcome.digest
