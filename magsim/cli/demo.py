"""``magsim demo``: the whole chain in one command."""

from pathlib import Path

import click


@click.command(short_help="Generate, train, compensate, and draw: the whole chain.")
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    type=click.Path(path_type=Path),
    default=Path("demo"),
    show_default=True,
    help="Output folder; only files of an earlier demo are replaced.",
)
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def demo(output: Path, quiet: bool) -> None:
    """Fly the calibration flight, train, compensate, score and draw.

    Circuit 1 of the flight is for fitting, its last leg for validation, circuit 2 for the comparison with the truth.
    """
    from magsim.cli.interrupts import delayed
    from magsim.cli.progress import simulating, training

    with delayed():
        from magsim.experiments.demo import run_demo

    announce = (lambda _text: None) if quiet else (lambda text: click.echo(text, err=True))
    result = run_demo(
        output,
        announce=announce,
        simulating=lambda: simulating(quiet=quiet),
        training=lambda: training(quiet=quiet),
    )
    click.echo(result.report.to_text(), nl=False)
    click.echo()
    for path in result.files:
        click.echo(f"{path}")
