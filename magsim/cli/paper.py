"""``magsim paper``: re-run a paper."""

import re
from pathlib import Path

import click


@click.command(short_help="Re-run one of the five papers, its tables beside ours.")
@click.argument("number", metavar="NNN")
@click.option(
    "-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="The run; default ./papers/NNN."
)
@click.option("--quick", is_flag=True, help="Minutes: few flights, short trainings. Shows that all of it runs.")
@click.option("--seeds", type=click.IntRange(min=1), help="Flights, or pairs of flights, that each figure is over.")
@click.option("--device", metavar="NAME", default="cpu", show_default=True, help="Where networks train: cpu, cuda, ...")
@click.option("--workers", type=click.IntRange(min=1), help="Processes, each on one thread; default one a core.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def paper(  # noqa: PLR0917 - the options
    number: str, output: Path | None, quick: bool, seeds: int | None, device: str, workers: int | None, quiet: bool
) -> None:
    """Re-run paper NNN (000 to 004): fly its flights, train its methods, print its tables beside what it prints.

    Everything goes into a folder: flights, one result for each piece of work, tables as text, CSV and JSON, figures.
    The same command goes on where it was broken off, and does nothing twice.
    """
    import os

    from magsim.papers import Effort, run_paper
    from magsim.papers.tables import text

    if not re.fullmatch(r"cpu|cuda(:\d+)?", device):
        msg = f"--device {device!r} is not allowed; allowed: cpu, cuda, cuda:0, cuda:1, ..."
        raise click.UsageError(msg)

    def announce(line: str) -> None:
        if not quiet:
            click.echo(line, err=True)

    folder = output or Path("papers") / number
    run = run_paper(
        number, folder, Effort(quick, seeds, device), workers=workers or os.cpu_count() or 1, announce=announce
    )
    for table in run.tables:
        click.echo(text(table))
    if quick:
        click.echo("This was the quick run, which shows that all of it works; its figures are of few flights.\n")
    click.echo(f"{folder}: {len(run.files)} files of tables and figures")
