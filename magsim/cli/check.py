"""``magsim check``: check that a method keeps what a compensator promises."""

from pathlib import Path

import click


@click.command(short_help="Check a compensator of your own.")
@click.argument("method")
@click.argument("recordings", nargs=-1, type=click.Path(path_type=Path))
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of fits and of draws.")
@click.pass_context
def check(ctx: click.Context, method: str, recordings: tuple[Path, ...], sensor: str | None, seed: int) -> None:
    """Check METHOD: determinism, declared inputs, causality, anomalies of random shape, files, and more.

    METHOD is a class of your own, my_file.py:MyMethod, or a name such as tl16, with settings if need be. RECORDINGS are
    files or folders with labels; without any, a small flight that is built in. The exit code is 3 if a check fails.
    """
    from magsim.compensation import check_compensator
    from magsim.errors import DataError

    report = check_compensator(method, data=list(recordings) or None, sensor=sensor, seed=seed)
    click.echo(str(report))
    if not report.passed:
        ctx.exit(DataError.exit_code)
