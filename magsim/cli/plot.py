"""``magsim plot``: figures of a recording."""

from pathlib import Path

import click


@click.command(name="plot", short_help="Draw a figure of a recording.")
@click.argument("kind", type=click.Choice(["flight", "field", "interference", "spectrum", "electronics", "tow"]))
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="PNG, SVG or PDF; default ./<flight>_<kind>.png")
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option("--force", is_flag=True, help="Replace an existing figure.")
def plot(kind: str, file: Path, output: Path | None, sensor: str | None, force: bool) -> None:
    """Draw a figure of FILE, a recording of one flight.

    \b
    flight        ground track, attitude and height
    field         reading and background
    interference  contribution of each part of the platform, in full and in the compensation band
    spectrum      spectral densities of the field and of the attitude
    electronics   currents and voltages, and the field of the wiring
    tow           swing of a towed bird: angles, tension, heights, spectrum
    """  # noqa: D301 - \b is for click
    from magsim import plots
    from magsim.recording import Recording

    recording = Recording.read(file)
    target = output or Path(f"{recording.name}_{kind}.png")
    plots.save(plots.KINDS[kind](recording, sensor), target, force=force)
    click.echo(f"{target}")
