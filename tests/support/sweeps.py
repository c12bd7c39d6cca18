"""Small sweeps, and what became of them."""

import hashlib
from pathlib import Path

from magsim import sweep as room
from magsim.sweep import SweepOutcome, SweepPlan
from magsim.sweep.shard import ShardTask, fly_shard
from magsim.sweep.workers import Died, Finished

LINE = """\
schema = 1
seed = 1
aircraft = "c208b"

[start]
lat_deg = 16.720
lon_deg = 112.729
alt_m = 1000.0
speed_mps = 75.0
heading_deg = 0.0

[pattern]
kind = "straight"
leg_m = 500.0
lead_s = 0.0

[[sensors.scalar]]
name = "cabin"
mount = "cabin_center"
"""
"""Seven seconds on a line, without [sweep]."""

HEADINGS = """
[sweep]
flights = {flights}
seed = 5
shard = {shard}

[[sweep.axes]]
key = "start.heading_deg"
uniform = [0.0, 360.0]

[[sweep.axes]]
key = "sensors.scalar[0].noise_nt_rthz"
grid = [0.001, 0.1]
"""
"""Flights in all directions, each with two magnetometers."""


def sweep_file(folder: Path, tail: str = "", *, flights: int = 8, shard: int = 2) -> Path:
    """Write a small sweep; ``tail`` is added to it."""
    path = folder / "line.toml"
    path.write_text(LINE + HEADINGS.format(flights=flights, shard=shard) + tail, encoding="utf-8")
    return path


def fly(plan: SweepPlan, folder: Path, **options: object) -> SweepOutcome:
    """Fly a sweep on two processes, to its end; what is there already is kept."""
    outcome = room.fly(plan, folder, resume=True, **{"workers": 2, **options})  # type: ignore[arg-type]
    assert outcome is not None
    return outcome


def bytes_of(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a finished sweep by name, without what tells how it was flown."""
    names = ("*.h5", "*.parquet", "*.csv", "report.json", "manifest.json")
    files = sorted(path for pattern in names for path in folder.glob(pattern))
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


class InThisProcess:
    """Workers of a sweep without processes of their own."""

    wanted = 1

    def __init__(self) -> None:
        self._ended: list[Finished | Died] = []

    def submit(self, task: ShardTask) -> None:
        """Fly a file at once."""
        self._ended.append(Finished(task, fly_shard(task)))

    def wait(self, _timeout_s: float) -> list[Finished | Died]:
        """Return what was flown."""
        ended, self._ended = self._ended, []
        return ended

    def close(self, *, at_once: bool) -> None:
        """Do nothing."""
