"""``magsim export``: recordings for other programs."""

from pathlib import Path

import click

FORMATS = ("mit", "xyz", "sgl-xyz", "gdf2", "csv", "parquet")


@click.command(short_help="Write a recording for other programs.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--format", "kind", type=click.Choice(FORMATS), required=True, help="Format of the files.")
@click.option(
    "-o",
    "--output",
    metavar="PATH",
    type=click.Path(path_type=Path),
    help="File or folder; default the working folder.",
)
@click.option("--flight", metavar="NAME|NUMBER", help="One flight of several.")
@click.option(
    "--roles",
    metavar="LIST",
    default="input,label,truth,segment",
    show_default=True,
    help="Roles to write.",
)
@click.option("--force", is_flag=True, help="Replace existing files.")
def export(  # noqa: PLR0917 - the options
    file: Path, kind: str, output: Path | None, flight: str | None, roles: str, force: bool
) -> None:
    """Write the flights of FILE, a recording or a folder of them, for other programs.

    \b
    mit      HDF5 in the layout that MagNav.jl reads; truth in groups
    xyz      Geosoft XYZ with LINE records
    sgl-xyz  XYZ as SGL writes it, the fields of its 2020 flights
    gdf2     ASEG-GDF2: .dat and .dfn
    csv      every column, all digits
    parquet  every column, with units; needs pip install "aeromagsim[parquet]"

    One file holds one flight. Several go into a folder that -o names, or --flight picks one.
    """  # noqa: D301 - \b is for click
    from magsim import exchange
    from magsim.errors import RequestError
    from magsim.recording import read_recordings

    chosen = exchange.pick(read_recordings(file), flight)
    for path in exchange.targets(chosen, kind, output):
        if path.exists() and (path.samefile(file) or (file.is_dir() and path.suffix == ".h5")):
            msg = f"{path} is the recording itself; give another path with -o"
            raise RequestError(msg)
    asked = [role.strip() for role in roles.split(",") if role.strip()]
    for path in exchange.export(chosen, kind, output, roles=asked, force=force):
        click.echo(str(path))
