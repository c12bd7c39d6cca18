"""``magsim sweep``: many flights that differ in some keys of one scenario."""

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from magsim import forking

if TYPE_CHECKING:
    from magsim.sweep import SweepPlan, SweepProgress


MOST_PARTS = 1_000_000


class _Part(click.ParamType):
    """A part of a sweep: i/n."""

    name = "i/n"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        first, _slash, second = str(value).partition("/")
        decimal = first.isdecimal() and second.isdecimal()
        if not decimal or not 1 <= int(first) <= int(second) <= MOST_PARTS:
            self.fail(f"{value!r} is no part of a sweep; allowed: i/n, from 1/n to n/n, such as 2/4", param, ctx)
        return int(first), int(second)


@click.command(short_help="Fly a scenario in thousands of variations.")
@click.argument("sweep_file", metavar="FILE")
@click.option(
    "-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="Where; default ./data/<name of FILE>"
)
@click.option(
    "--dry-run", is_flag=True, help="Show what would be flown, and what it costs: flies a few and times them."
)
@click.option("-w", "--workers", type=click.IntRange(1, 10_000), help="Processes that fly; default one a core.")
@click.option(
    "--engine", type=click.Choice(["local", "dask"]), default="local", show_default=True, help="Whose processes fly."
)
@click.option("--scheduler", metavar="ADDRESS", help="Of a dask cluster that runs already, such as tcp://node1:8786.")
@click.option("--shard", "part", type=_Part(), help="Fly every n-th file only, from the i-th: for a queue of your own.")
@click.option("--resume", is_flag=True, help="Go on with what an earlier run left in FOLDER.")
@click.option("--max-failures", type=click.IntRange(0), help="End when more flights than this failed; default never.")
@click.option(
    "--set",
    "overrides",
    metavar="KEY.PATH=VALUE",
    multiple=True,
    help="Change one setting, for example --set sweep.flights=10; may be repeated.",
)
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def sweep(  # noqa: PLR0917 - the options
    sweep_file: str,
    output: Path | None,
    dry_run: bool,
    workers: int | None,
    engine: str,
    scheduler: str | None,
    part: tuple[int, int] | None,
    resume: bool,
    max_failures: int | None,
    overrides: tuple[str, ...],
    quiet: bool,
) -> None:
    """Fly the flights of a sweep into a folder, which is a data set.

    FILE is a scenario with a [sweep], or the name of a shipped one such as sweeps/places_and_dates. A flight that
    cannot be flown is written to failures.csv and does not end the sweep. Whatever ends it, --resume goes on, with any
    number of workers; the files are the same in every byte.
    """
    from magsim.cli.interrupts import delayed

    if scheduler is not None and engine != "dask":
        msg = f"--scheduler {scheduler}: has no effect with --engine {engine}; allowed: with --engine dask"
        raise click.UsageError(msg)
    if engine == "local" and not dry_run:
        forking.begin()  # it imports while this process does
    with delayed():
        from magsim import sweep as room

    plan = room.read_sweep(sweep_file, overrides)
    target = output or Path("data") / plan.file.name
    if dry_run:
        _rehearse(plan, target, workers or os.cpu_count() or 1, quiet=quiet)
        return
    for refused in room.check(plan)[:3]:
        click.echo(f"warning: flight {refused.flight.number} cannot be flown: {refused.reason}", err=True)
    show = _progress(quiet=quiet)
    begun = False

    def report(progress: "SweepProgress") -> None:
        nonlocal begun
        begun = True
        show(progress)

    team = room.cluster_workers(scheduler, workers) if engine == "dask" else workers
    try:
        outcome = room.fly(
            plan,
            target,
            workers=team,
            part=part or (1, 1),
            resume=resume,
            max_failures=max_failures,
            report=report,
        )
    except BaseException:
        if begun:
            click.echo(f"{target}: what has been flown is kept; --resume goes on with it", err=True)
        raise
    finally:
        show(None)
    if outcome is None:
        click.echo(f"{target}: this part is flown; the index follows when the other parts are")
        return
    click.echo(outcome.tally.to_text())
    click.echo(f"{target}: {outcome.tally.flown} flights, digest {outcome.digest}")


def _free(target: Path) -> int:
    """Return the free space where a folder would be made [bytes]."""
    there = next(folder for folder in (target.absolute(), *target.absolute().parents) if folder.is_dir())
    return shutil.disk_usage(there).free


def _rehearse(plan: "SweepPlan", target: Path, workers: int, *, quiet: bool) -> None:
    """Print what a sweep would fly and cost."""
    from magsim import sweep as room

    found, count = room.ranges(plan)
    about = "about " if plan.settings.require and plan.space.count > room.MOST_EXPANDED else ""
    click.echo(
        f"flights     {about}{count} of {plan.space.count} that the grid and the draws make, in {plan.shards} files"
    )
    width = max((len(name) for name in found), default=0)
    for name, values in found.items():
        click.echo(f"{name:<{width}}  {values.text}")
    for refused in room.check(plan)[:3]:
        click.echo(f"flight {refused.flight.number} cannot be flown: {refused.reason}")
    cost = room.measure(plan, (lambda _line: None) if quiet else (lambda line: click.echo(line, err=True)))
    flown = cost.flown(plan, count)
    if flown < count:
        click.echo(f"flown       {flown}, each dressed {plan.space.count // plan.space.flown_count} times")
    total_s = cost.total_s(count, flown)
    click.echo(
        f"a flight    {cost.flight_s:.2f} s of one core, {cost.simulated_s:.0f} s of flight, {cost.size / 1e6:.2f} MB"
    )
    if flown < count:
        click.echo(f"a dressing  {cost.dressing_s:.2f} s of one core")
    click.echo(
        f"altogether  {total_s / 3600.0:.3g} core hours, {room.duration(total_s / workers)} with {workers} workers, "
        f"{count * cost.size / 1e9:.3g} GB of {_free(target) / 1e9:.0f} free (from {cost.timed} flights)"
    )


def _progress(*, quiet: bool) -> "Callable[[SweepProgress | None], None]":
    """Return what shows progress on stderr: one line that is written over on a terminal, else one a tenth."""
    if quiet:
        return lambda _progress: None
    terminal, shown = sys.stderr.isatty(), -1

    def show(progress: "SweepProgress | None") -> None:
        nonlocal shown
        if progress is None:
            if terminal:
                click.echo("", err=True)
            return
        tenth = 10 * progress.done // max(progress.flights, 1)
        if terminal:
            click.echo(f"\r\x1b[K{_line(progress)}", nl=False, err=True)
        elif tenth != shown and progress.fresh:
            click.echo(_line(progress), err=True)
            shown = tenth

    return show


def _line(progress: "SweepProgress") -> str:
    from magsim.sweep import duration

    left = "-" if progress.remaining_s is None else duration(progress.remaining_s)
    return (
        f"{progress.done}/{progress.flights} flights, {progress.flown_s / 3600.0:.1f} h flown, "
        f"{60.0 * progress.rate:.1f} flights/min, {progress.failed} failed, ETA {left}"
    )
