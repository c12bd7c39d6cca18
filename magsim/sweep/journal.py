"""The journal of a sweep: one record for each finished file, written after it, and a log of the file in work.

``journal/00000012.json`` states what shard 12 holds, with its checksum, and why flights of it failed; a shard without
a valid record is flown. ``journal/00000012.log`` is locked by the process that flies the shard and holds the numbers of
the flights that it has begun, so that two processes seldom fly the same, and the flight is known on which one died.
"""

import contextlib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from magsim.config import Strict
from magsim.dataset.manifest import Count, FlightEntry, Sha256
from magsim.errors import RequestError
from magsim.storage import atomic_text

try:
    import fcntl
except ImportError:  # no POSIX
    fcntl = None  # type: ignore[assignment]

JOURNAL = "journal"
"""Folder of the records in that of a sweep."""

_RECORD = re.compile(r"(\d{8})\.json")

Kind = Literal["refused", "failed", "error", "killed"]
"""refused: the settings cannot be flown; failed: the flight could not be finished; error: a fault of magsim or of a
library; killed: the process died on it every time."""


class Flown(Strict):
    """One flight of a shard."""

    number: Count
    entry: FlightEntry
    duration_s: float
    seed: Count
    interference_std_nt: dict[str, float]


class Failed(Strict):
    """One flight that a shard lacks."""

    number: Count
    kind: Kind
    reason: str


class ShardRecord(Strict):
    """One finished shard."""

    shard: Count
    last_place: Count = Field(description="places of the sweep's order that are filled at its end")
    sha256: Sha256 | None = Field(default=None, description="of the file; None where no flight of it succeeded")
    size: Count = 0
    attempts: Count = Field(default=1, description="processes that began on it; not part of what it is")
    flown: Annotated[tuple[Flown, ...], Field(strict=False)] = ()
    failed: Annotated[tuple[Failed, ...], Field(strict=False)] = ()


def file_name(shard: int) -> str:
    """Name of the recordings of a shard."""
    return f"shard_{shard:08d}.h5"


@dataclass(frozen=True)
class Journal:
    """The journal in the folder of a sweep.

    Attributes
    ----------
    folder : Path
        Of the sweep.
    """

    folder: Path

    def make(self) -> None:
        """Make the folder of the records.

        Raises
        ------
        RequestError
            If it cannot be made.
        """
        try:
            (self.folder / JOURNAL).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"cannot write {self.folder / JOURNAL}: {error.strerror}"
            raise RequestError(msg) from None

    def shards(self) -> list[int]:
        """Return the shards that have a record, in order."""
        with contextlib.suppress(FileNotFoundError):
            found = (_RECORD.fullmatch(entry.name) for entry in os.scandir(self.folder / JOURNAL))
            return sorted(int(match[1]) for match in found if match)
        return []

    def read(self, shard: int) -> ShardRecord | None:
        """Return the record of a shard whose file is there in its size, or None."""
        try:
            record = ShardRecord.model_validate_json(self.path(shard).read_bytes())
            whole = record.sha256 is None or (self.folder / file_name(shard)).stat().st_size == record.size
        except (OSError, ValidationError):
            return None
        return record if whole and record.shard == shard else None

    def write(self, record: ShardRecord) -> None:
        """Write a record, after its file.

        Raises
        ------
        RequestError
            If it cannot be written.
        """
        text = record.model_dump_json(indent=None) + "\n"
        path = self.path(record.shard)
        atomic_text(path, text, force=True)

    def begun(self, shard: int) -> list[int]:
        """Return the flights of a shard that processes have begun, in order; a process that starts on it notes -1."""
        try:
            words = self._log(shard).read_text(encoding="ascii").split()
        except (OSError, ValueError):
            return []
        return [int(word) for word in words if re.fullmatch(r"-1|\d{1,12}", word)]

    @contextlib.contextmanager
    def lock(self, shard: int) -> Iterator["ShardLog | None"]:
        """Lock a shard for flying; None where another process flies it.

        Where a file system has no locks, two processes may fly the same shard: both write the same bytes.
        """
        with self._log(shard).open("a", encoding="ascii") as log:
            if fcntl is not None:
                try:
                    fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    yield None
                    return
                except OSError:
                    pass
            noted = ShardLog(log.fileno())
            noted.begin(-1)
            yield noted

    def forget(self, shard: int) -> None:
        """Remove the log of a finished shard."""
        self._log(shard).unlink(missing_ok=True)

    def path(self, shard: int) -> Path:
        """Return where the record of a shard lies."""
        return self.folder / JOURNAL / f"{shard:08d}.json"

    def _log(self, shard: int) -> Path:
        return self.folder / JOURNAL / f"{shard:08d}.log"


@dataclass(frozen=True)
class ShardLog:
    """The log of a shard in work."""

    handle: int

    def begin(self, number: int) -> None:
        """Note that a flight begins."""
        os.write(self.handle, f"{number}\n".encode("ascii"))
