"""The work of one task: fly the flights of one file, write it, and record what it holds. Any process may do it."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.dataset.manifest import FlightEntry
from magsim.errors import DataError, MagsimError, RequestError
from magsim.recording import Recording, write_recordings
from magsim.simulation import Simulator
from magsim.sweep.journal import Failed, Flown, Journal, Kind, ShardLog, ShardRecord, file_name
from magsim.sweep.plan import SweepFile, SweepPlan, plan_of
from magsim.sweep.space import SweptFlight

LONGEST_REASON = 500
"""Characters of a reason that are kept."""


@dataclass(frozen=True)
class ShardTask:
    """One file to be flown.

    Attributes
    ----------
    file : SweepFile
    identity : str
        Of the plan that was made of it where the task was given.
    folder : str
        Of the sweep.
    shard : int
    condemned : tuple of int
        Flights that are not begun again, because processes died on them.
    """

    file: SweepFile
    identity: str
    folder: str
    shard: int
    condemned: tuple[int, ...] = ()


@dataclass(frozen=True)
class ShardResult:
    """What became of a task.

    Attributes
    ----------
    shard : int
    busy : bool
        Another process is flying it; nothing was done.
    flown, failed : int
        Flights.
    flown_s : float [s]
        Flight time that was simulated.
    size : int
        Of the file [bytes].
    spent_s : float [s]
        Processor time of the task.
    """

    shard: int
    busy: bool = False
    flown: int = 0
    failed: int = 0
    flown_s: float = 0.0
    size: int = 0
    spent_s: float = 0.0

    @classmethod
    def of(cls, record: ShardRecord) -> "ShardResult":
        """Return the tally of a record; nothing was spent."""
        flown_s = sum(flight.duration_s for flight in record.flown)
        return cls(record.shard, False, len(record.flown), len(record.failed), flown_s, record.size)


def fly_shard(task: ShardTask) -> ShardResult:
    """Fly a shard, unless it is finished or another process is at it.

    Raises
    ------
    RequestError
        If its file cannot be written, for example because the disk is full. Nothing of the shard is left then.
    DataError
        If the files that the sweep refers to are not those of the process that gave the task.
    """
    plan, journal, began = warm(task.file), Journal(Path(task.folder)), time.process_time()
    if plan.identity != task.identity:
        msg = (
            f"{task.file.source}: this process reads another scenario, aircraft or version than the one that started "
            "the sweep; allowed: the same files and the same version of magsim everywhere"
        )
        raise DataError(msg)
    with journal.lock(task.shard) as log:
        if log is None:
            return ShardResult(task.shard, busy=True)
        record = journal.read(task.shard)
        if record is None or record.last_place != plan.last_place(task.shard):
            record = _fly(plan, task, journal, log)
            record = record.model_copy(update={"attempts": journal.begun(task.shard).count(-1)})
            journal.write(record)
        journal.forget(task.shard)
    return replace(ShardResult.of(record), spent_s=time.process_time() - began)


@lru_cache(maxsize=2)
def warm(file: SweepFile) -> SweepPlan:
    """Return the plan of a sweep, read once in each process."""
    return plan_of(file)


def _fly(plan: SweepPlan, task: ShardTask, journal: Journal, log: ShardLog) -> ShardRecord:
    flights = plan.flights(task.shard)
    flown: list[Flown] = []
    failed: list[Failed] = []

    def recordings() -> Iterator[Recording]:
        simulator = Simulator()
        for flight in flights:
            log.begin(flight.number)
            made = _one(plan, flight, simulator, task.condemned)
            if isinstance(made, Failed):
                failed.append(made)
                continue
            flown.append(_described(flight, made))
            yield made

    path, made = journal.folder / file_name(task.shard), recordings()
    first = next(made, None)
    record = ShardRecord(shard=task.shard, last_place=plan.last_place(task.shard))
    if first is None:
        path.unlink(missing_ok=True)
        return record.model_copy(update={"failed": tuple(failed)})
    sha256 = write_recordings(path, chain([first], made), force=True)
    update = {"sha256": sha256, "size": path.stat().st_size, "flown": tuple(flown), "failed": tuple(failed)}
    return record.model_copy(update=update)


def _one(plan: SweepPlan, flight: SweptFlight, simulator: Simulator, condemned: tuple[int, ...]) -> Recording | Failed:
    """Fly one flight, or say why it could not be flown."""
    if flight.number in condemned:
        return _failed(flight, "killed", "every process that flew it was killed; is there enough memory?")
    try:
        recording = simulator.simulate(plan.load(flight))
    except MagsimError as error:
        kind: Kind = "refused" if isinstance(error, RequestError) else "failed"
        return _failed(flight, kind, str(error))
    except (MemoryError, OSError):
        raise
    except Exception as error:  # a fault on one flight of thousands must not end them all
        return _failed(flight, "error", f"{type(error).__name__}: {error}")
    return replace(recording, name=flight.name)


def _failed(flight: SweptFlight, kind: Kind, reason: str) -> Failed:
    # the settings of a flight are overrides, but nobody has written --set
    told = " | ".join(line.removeprefix("--set ") for line in reason.splitlines())
    plain = "".join(c if c.isprintable() else " " for c in told)
    return Failed(number=flight.number, kind=kind, reason=plain[:LONGEST_REASON])


def _described(flight: SweptFlight, recording: Recording) -> Flown:
    """Return what the journal keeps of a recording."""
    stds = {}
    for sensor in recording.scalars:
        name = columns.INTERFERENCE.name(sensor=sensor)
        if name in recording:
            stds[sensor] = float(np.std(recording[name]))
    duration_s = float(recording.time_s[-1] - recording.time_s[0])
    return Flown(
        number=flight.number,
        entry=FlightEntry.of(recording),
        duration_s=duration_s,
        seed=int(str(recording.meta["seed"])),
        interference_std_nt=stds,
    )
