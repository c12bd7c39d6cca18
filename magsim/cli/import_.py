"""``magsim import``: recordings from files of other programs."""

from pathlib import Path

import click

FORMATS = ("mit", "sgl-xyz", "xyz", "csv")


@click.command(name="import", short_help="Make a recording from a survey file.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--format", "kind", type=click.Choice(FORMATS), help="Default: according to the ending of FILE.")
@click.option("-o", "--output", metavar="FILE", type=click.Path(path_type=Path), help="Default ./<flight>.h5")
@click.option("--map", "column_map", metavar="FILE", type=click.Path(path_type=Path), help="TOML file of column names.")
@click.option("--flight", metavar="NUMBER", type=float, help="One flight of several in the file, for example 1002.")
@click.option("--train", metavar="WINDOW", multiple=True, help="Rows for training: a line, or START:END.")
@click.option("--valid", metavar="WINDOW", multiple=True, help="Rows for validation.")
@click.option("--test", metavar="WINDOW", multiple=True, help="Rows for testing.")
@click.option("--force", is_flag=True, help="Replace an existing recording.")
def import_(  # noqa: PLR0917 - the options
    file: Path,
    kind: str | None,
    output: Path | None,
    column_map: Path | None,
    flight: float | None,
    train: tuple[str, ...],
    valid: tuple[str, ...],
    test: tuple[str, ...],
    force: bool,
) -> None:
    """Make a recording, without truth, from FILE, which another program wrote.

    \b
    mit      HDF5 in the layout of MagNav.jl (SGL 2020 and 2021)
    sgl-xyz  XYZ as SGL writes it
    xyz      Geosoft XYZ with LINE records, columns named as in a recording or by --map
    csv      one line of names, then numbers with commas; named likewise

    Windows are lines (1002.02) or spans of the file's own time (46390.9:46964.5), and may be repeated. Rows in no
    window are left out. Without windows all rows are imported, without a split.
    """  # noqa: D301 - \b is for click
    from magsim import exchange, storage
    from magsim.cli.messages import print_error
    from magsim.errors import RequestError
    from magsim.recording.foreign import doubts_of

    if output is not None:
        storage.check_target(output, force=force)
    windows = {"train": train, "valid": valid, "test": test}
    made = exchange.import_flight(file, kind, column_map=column_map, flight=flight, windows=windows)
    target = output or Path(f"{exchange.stem(made.recording.name)}.h5")
    if target.exists() and target.samefile(file):
        msg = f"{target} is the file that is read; give another path with -o"
        raise RequestError(msg)
    made.recording.write(target, force=force)
    for note in made.notes:
        click.echo(note, err=True)
    recording = made.recording
    for doubt in doubts_of(recording):
        print_error(f"warning: {recording.name}: {doubt}")
    duration = recording.time_s[-1] - recording.time_s[0]
    click.echo(f"{target}: {len(recording)} rows, {duration:.1f} s, {len(recording.data)} columns")
