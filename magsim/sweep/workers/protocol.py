"""What the workers of a sweep do, whoever they are."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from magsim.sweep.shard import ShardResult, ShardTask


@dataclass(frozen=True)
class Finished:
    """A task that came to its end."""

    task: ShardTask
    result: ShardResult


@dataclass(frozen=True)
class Died:
    """A task whose process was killed."""

    task: ShardTask


@runtime_checkable
class Workers(Protocol):
    """Workers that fly shards. A worker that dies is replaced; its task comes back as ``Died``."""

    @property
    def wanted(self) -> int:
        """How many tasks it wants to have at a time: enough that no worker waits."""

    def submit(self, task: ShardTask) -> None:
        """Take a task."""

    def wait(self, timeout_s: float) -> list[Finished | Died]:
        """Return what has ended, after at most a time; a task that raised an error raises it here."""

    def close(self, *, at_once: bool) -> None:
        """Dismiss the workers, at once or when they have nothing to do."""
