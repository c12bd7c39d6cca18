"""``magsim verify``: whether a recording file is as it was written."""

from pathlib import Path

import click


@click.command(short_help="Check a recording file in every byte.")
@click.argument("file", type=click.Path(path_type=Path))
def verify(file: Path) -> None:
    """Check FILE against its checksums and against the table of columns.

    Any changed byte is found. Ends with 0 and one line where the file is sound, else with 3 and a line for each
    difference. FILE is read by a process of its own first, with limits of memory and time.
    """
    from magsim.recording.verify import verify as check

    found = check(file)
    flights = "1 flight" if len(found.flights) == 1 else f"{len(found.flights)} flights"
    click.echo(f"{file}: sound; {flights}, {found.rows} rows, {found.columns} columns, {found.size} bytes")
    click.echo(f"sha256 {found.digest}")
