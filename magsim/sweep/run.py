"""Flying of a sweep: what is left is given to workers, and every finished file is in the journal, whatever happens."""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from magsim.errors import DataError
from magsim.sweep.journal import Journal
from magsim.sweep.plan import SweepPlan
from magsim.sweep.shard import ShardResult, ShardTask
from magsim.sweep.workers import Died, Finished, Workers

MOST_DEATHS = 3
"""Processes that die on one flight until it counts as failed."""

MOST_EARLY_DEATHS = 5
"""Processes that die in turn before they have begun a flight until the sweep ends."""

WAIT_S = 1.0
"""Between looks at progress and at shards that other processes fly."""


@dataclass(frozen=True)
class SweepProgress:
    """How far a sweep is.

    Attributes
    ----------
    flights : int
        All that it has in this part, without those that constraints leave out of finished files.
    flown, failed : int
        In finished files.
    flown_s : float [s]
        Flight time in finished files.
    size : int
        Of finished files [bytes].
    spent_s : float [s]
        Processor time of the workers in this run.
    elapsed_s : float [s]
        Since this run began.
    fresh : int
        Flights of this run, failed ones included.
    """

    flights: int
    flown: int = 0
    failed: int = 0
    flown_s: float = 0.0
    size: int = 0
    spent_s: float = 0.0
    elapsed_s: float = 0.0
    fresh: int = 0

    @property
    def done(self) -> int:
        """Flights in finished files, failed ones included."""
        return self.flown + self.failed

    @property
    def rate(self) -> float:
        """Flights a second in this run."""
        return self.fresh / self.elapsed_s if self.elapsed_s > 0.0 else 0.0

    @property
    def remaining_s(self) -> float | None:
        """Time that the rest will take [s]; None before the first flight of this run."""
        return (self.flights - self.done) / self.rate if self.fresh else None

    def after(self, result: ShardResult, expected: int, *, fresh: bool) -> "SweepProgress":
        """Return the progress with one more finished file, of which so many flights were expected."""
        found = result.flown + result.failed
        return replace(
            self,
            flights=self.flights - expected + found,
            flown=self.flown + result.flown,
            failed=self.failed + result.failed,
            flown_s=self.flown_s + result.flown_s,
            size=self.size + result.size,
            spent_s=self.spent_s + result.spent_s,
            fresh=self.fresh + (found if fresh else 0),
        )


def run(
    plan: SweepPlan,
    journal: Journal,
    workers: Workers,
    *,
    part: tuple[int, int] = (1, 1),
    max_failures: int | None = None,
    report: Callable[[SweepProgress], None] = lambda _progress: None,
) -> SweepProgress:
    """Fly what a part of a sweep lacks.

    Parameters
    ----------
    plan : SweepPlan
    journal : Journal
        Of the folder that was opened for the plan.
    workers : Workers
        It is closed at the end.
    part : (int, int)
        ``(i, n)``: every n-th file, from the i-th, 1 to n.
    max_failures : int, optional
        Failed flights after which the part ends.
    report : callable
        Called after each file, and about once a second.

    Returns
    -------
    SweepProgress
        At the end.

    Raises
    ------
    RequestError
        If a file cannot be written; every finished file is kept.
    DataError
        If too many flights failed, processes die at their start, or the sweep's files have changed meanwhile.
    """
    driver = _Driver(plan, journal, workers, part=part, max_failures=max_failures, report=report)
    finished = False
    try:
        driver.fly()
        finished = True
    finally:
        workers.close(at_once=not finished)
    return driver.progress


class _Driver:
    """The state of a run."""

    def __init__(
        self,
        plan: SweepPlan,
        journal: Journal,
        workers: Workers,
        *,
        part: tuple[int, int],
        max_failures: int | None,
        report: Callable[[SweepProgress], None],
    ) -> None:
        self._plan, self._workers, self._report = plan, workers, report
        self._journal, self._folder = journal, journal.folder
        self._most = max_failures
        self._deaths: Counter[int] = Counter()
        self._early_deaths = 0
        self._began = time.monotonic()
        self._again: deque[ShardTask] = deque()
        self._busy: deque[ShardTask] = deque()
        self._working = 0
        mine = range(part[0] - 1, plan.shards, part[1])
        self.progress = SweepProgress(sum(self._expect(shard) for shard in mine))
        self._left = self._missing(mine)

    def fly(self) -> None:
        """Fly until nothing is left."""
        waiting = next(self._left, None)
        self._tell()
        while waiting or self._working or self._again or self._busy:
            while self._working < self._workers.wanted and (waiting or self._again):
                if self._again:
                    task = self._again.popleft()
                else:
                    assert waiting is not None
                    task, waiting = waiting, next(self._left, None)
                self._workers.submit(task)
                self._working += 1
            if self._working:
                for ended in self._workers.wait(WAIT_S):
                    self._working -= 1
                    self._note(ended)
            else:  # other processes fly all that is left
                time.sleep(WAIT_S)
            if not waiting and not self._again and not self._working:
                self._again, self._busy = self._busy, deque()
            self._tell()

    def _expect(self, shard: int) -> int:
        """Return how many flights a file has if no constraint leaves any out."""
        return self._plan.last_place(shard) - shard * self._plan.settings.shard

    def _missing(self, mine: range) -> Iterator[ShardTask]:
        """Yield the tasks of shards without a record, and count the others."""
        recorded = set(self._journal.shards())
        for shard in mine:
            record = self._journal.read(shard) if shard in recorded else None
            if record is not None and record.last_place == self._plan.last_place(shard):
                self.progress = self.progress.after(ShardResult.of(record), self._expect(shard), fresh=False)
                self._check_failures()
                continue
            yield ShardTask(self._plan.file, self._plan.identity, str(self._folder), shard)

    def _note(self, ended: Finished | Died) -> None:
        if isinstance(ended, Died):
            self._bury(ended.task)
        elif ended.result.busy:
            self._busy.append(ended.task)
        else:
            self._early_deaths = 0
            shard = ended.result.shard
            self.progress = self.progress.after(ended.result, self._expect(shard), fresh=True)
            self._check_failures()

    def _bury(self, task: ShardTask) -> None:
        """Give a task again whose process died, without the flight on which processes keep dying."""
        begun = self._journal.begun(task.shard)
        if not begun or begun[-1] < 0:
            self._early_deaths += 1
            if self._early_deaths >= MOST_EARLY_DEATHS:
                msg = (
                    f"{self._folder}: processes die before they have begun a flight; is there enough memory? "
                    "fewer workers need less"
                )
                raise DataError(msg)
        else:
            self._deaths[begun[-1]] += 1
        condemned = tuple(number for number, deaths in sorted(self._deaths.items()) if deaths >= MOST_DEATHS)
        self._again.append(replace(task, condemned=condemned))

    def _check_failures(self) -> None:
        if self._most is not None and self.progress.failed > self._most:
            msg = (
                f"{self._folder}: {self.progress.failed} flights failed; allowed: at most {self._most} (--max-failures)"
            )
            raise DataError(msg)

    def _tell(self) -> None:
        self.progress = replace(self.progress, elapsed_s=time.monotonic() - self._began)
        self._report(self.progress)
