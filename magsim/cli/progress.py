"""Progress of long work on stderr."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from magsim.training import Progress


@contextmanager
def stages(*, quiet: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Bars for work that comes in named stages.

    Parameters
    ----------
    quiet : bool
        Show nothing. Nothing is shown either where stderr is no terminal.

    Yields
    ------
    callable
        ``report(stage, fraction)`` with the fraction from 0 to 1; a new name adds a bar.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _stage, _fraction: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

    shown = Progress(
        TextColumn("{task.description:<12}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    )
    tasks: dict[str, TaskID] = {}

    def report(stage: str, fraction: float) -> None:
        if stage not in tasks:
            tasks[stage] = shown.add_task(stage, total=1.0)
        shown.update(tasks[stage], completed=fraction)

    with shown:
        yield report


@contextmanager
def simulating(*, quiet: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Bars as those of ``stages``, with one more for each result that is not in the cache: steel, skin, response.

    Yields
    ------
    callable
        ``report(stage, fraction)``.
    """
    from magsim.storage import reported

    with stages(quiet=quiet) as report, reported(lambda kind, share: report(kind.replace("_", " "), share)):
        yield report


@contextmanager
def training(*, quiet: bool = False) -> Iterator[Callable[["Progress"], None]]:
    """Show loss, validation error and remaining time as bars.

    Parameters
    ----------
    quiet : bool
        Show nothing. Nothing is shown either where stderr is no terminal; ``log.csv`` has it all.

    Yields
    ------
    callable
        Takes a ``magsim.training.Progress``; a new phase adds a bar.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda _progress: None
        return
    from rich import progress as bars
    from rich.console import Console

    shown = bars.Progress(
        bars.TextColumn("{task.description:<8}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TextColumn("{task.fields[text]}"),
        console=Console(stderr=True),
    )
    tasks: dict[str, Any] = {}

    def report(progress: "Progress") -> None:
        if progress.phase not in tasks:
            tasks[progress.phase] = shown.add_task(progress.phase, total=progress.steps, text="")
        shown.update(tasks[progress.phase], completed=progress.step, text=_state(progress))

    with shown:
        yield report


def _state(progress: "Progress") -> str:
    if math.isnan(progress.valid):
        return "flights read"
    loss = "-" if math.isnan(progress.loss) else f"{progress.loss:.4g}"
    eta = "-" if math.isnan(progress.eta_s) else f"{progress.eta_s:.0f} s"
    return f"loss {loss}, in band {progress.valid:.4f} nT (best {progress.best:.4f}), ETA {eta}"
