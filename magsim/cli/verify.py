"""``magsim verify``: check that a recording file is unchanged."""

from pathlib import Path

import click


@click.command(short_help="Check a recording file in every byte.")
@click.argument("file", type=click.Path(path_type=Path))
def verify(file: Path) -> None:
    """Check FILE against its checksums and against the table of columns.

    Any changed byte is found. The exit code is 0 if the file is sound, else 3, with a line for each difference. FILE is
    first read by a process of its own, with limits of memory and time.
    """
    from magsim.recording.verify import verify as check

    found = check(file)
    flights = "1 flight" if len(found.flights) == 1 else f"{len(found.flights)} flights"
    click.echo(f"{file}: sound; {flights}, {found.rows} rows, {found.columns} columns, {found.size} bytes")
    click.echo(f"sha256 {found.digest}")
