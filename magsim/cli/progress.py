"""Progress of long work on stderr; silent where nobody watches."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


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
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    shown = Progress(
        TextColumn("{task.description:<12}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
    )
    tasks: dict[str, int] = {}

    def report(stage: str, fraction: float) -> None:
        if stage not in tasks:
            tasks[stage] = shown.add_task(stage, total=1.0)
        shown.update(tasks[stage], completed=fraction)

    with shown:
        yield report
