"""``magsim verify``: check that recording files are unchanged."""

from pathlib import Path

import click

from magsim.cli.messages import print_error


@click.command(short_help="Check recording files in every byte.")
@click.argument("files", nargs=-1, required=True, metavar="FILES...", type=click.Path(path_type=Path))
@click.pass_context
def verify(ctx: click.Context, files: tuple[Path, ...]) -> None:
    """Check FILES, recordings or folders of them, against their checksums and the table of columns.

    Any changed byte is found. A sound file is a line on stdout, each difference a line on stderr. The exit code is 0 if
    all files are sound, else 3, after all have been checked. Each file is first read by a process of its own, with
    limits of memory and time.
    """
    from magsim.errors import DataError, RequestError
    from magsim.recording.file import files_of
    from magsim.recording.verify import verify as check

    missing = [f"{path}: there is no such file or folder" for path in files if not path.exists()]
    if missing:
        raise RequestError("\n".join(missing))
    unsound = False
    for file in dict.fromkeys(path for named in files for path in files_of(named)):
        try:
            found = check(file)
        except DataError as error:
            unsound = True
            print_error(str(error))
            continue
        flights = "1 flight" if len(found.flights) == 1 else f"{len(found.flights)} flights"
        held = f"{flights}, {found.rows} rows, {found.columns} columns, {found.size} bytes"
        click.echo(f"{file}: sound; {held}; sha256 {found.digest}")
    if unsound:
        ctx.exit(DataError.exit_code)
