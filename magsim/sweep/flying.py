"""A sweep from its beginning, or from where it was broken off, to its end."""

import os
from collections.abc import Callable
from pathlib import Path

from magsim import forking
from magsim.sweep.finish import SweepOutcome, check_ready, finish
from magsim.sweep.folder import open_folder
from magsim.sweep.plan import SweepPlan, read_sweep
from magsim.sweep.rehearsal import check
from magsim.sweep.report import write_failures
from magsim.sweep.run import SweepProgress, run
from magsim.sweep.workers import LocalWorkers, Workers


def fly(
    sweep: str | Path | SweepPlan,
    folder: str | Path,
    *,
    workers: int | Workers | None = None,
    part: tuple[int, int] = (1, 1),
    resume: bool = False,
    max_failures: int | None = None,
    report: Callable[[SweepProgress], None] = lambda _progress: None,
) -> SweepOutcome | None:
    """Fly a sweep into a folder, which is a data set then.

    Parameters
    ----------
    sweep : str, Path or SweepPlan
        A sweep file, the name of a shipped one, or what ``read_sweep`` returns.
    folder : str or Path
    workers : int or Workers, optional
        Processes of this machine, one a core by default, no more than there are files; or ``cluster_workers(...)``,
        which are dismissed at the end.
    part : (int, int)
        ``(i, n)``: every n-th file alone, from the i-th, 1 to n. Other parts may be flown into the same folder.
    resume : bool
        Go on with what an earlier run left in the folder.
    max_failures : int, optional
        Failed flights after which the part ends.
    report : callable
        Called after each file, and about once a second.

    Returns
    -------
    SweepOutcome or None
        None while other parts are missing.

    Raises
    ------
    RequestError
        If the sweep cannot be flown, or a file cannot be written.
    DataError
        If the folder is of another sweep, or too many flights failed. Every finished file is kept.

    Examples
    --------
    >>> outcome = fly("sweeps/maneuvers", "data/maneuvers", workers=2)
    """
    given = workers if isinstance(workers, Workers) else None
    try:
        if given is None:
            forking.begin()  # it imports while the plan is read and checked
        check_ready()
        plan = sweep if isinstance(sweep, SweepPlan) else read_sweep(sweep)
        check(plan)
        journal = open_folder(plan, Path(folder), resume=resume, shared=part != (1, 1))
        team = given or LocalWorkers(min(workers if isinstance(workers, int) else os.cpu_count() or 1, plan.shards))
    except BaseException:
        if given is not None:
            given.close(at_once=True)
        raise
    try:
        run(plan, journal, team, part=part, max_failures=max_failures, report=report)
    except BaseException:
        write_failures(plan, journal)
        raise
    return finish(plan, journal)
