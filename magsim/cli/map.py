"""``magsim map``: the quiet places for a magnetometer."""

from pathlib import Path

import click


@click.command(name="map", short_help="Predict where on an aircraft a magnetometer is quiet.")
@click.argument("aircraft")
@click.option("--flight", metavar="FILE|SCENARIO", help="Recording or scenario; default a figure-of-merit flight.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Picture (.png, .svg) or page (.html).")
@click.option(
    "--spacing",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Step of the grid in m; default length / 25.",
)
@click.option("--top", type=click.IntRange(0, 100), default=5, show_default=True, help="How many best places to list.")
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON and nothing else.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def map_(
    aircraft: str,
    flight: str | None,
    output: Path | None,
    *,
    spacing: float | None,
    top: int,
    as_json: bool,
    force: bool,
) -> None:
    """Predict the figure of merit at the mounts of AIRCRAFT and on a grid in and around it.

    AIRCRAFT is c208b, uav, or the path of a folder of your own, with a slash: ./mine.
    The table is printed; with -o a picture on the aircraft's mesh is drawn, or a page with both.
    """
    from magsim import plots, storage
    from magsim.aircraft import load_aircraft
    from magsim.cli.progress import simulating
    from magsim.experiments.mount_report import check_output, draw_map, flight_of, flown_aircraft, make_map, write_page

    if output is not None:
        check_output(output)
        storage.check_target(output, force=force)
    loaded = load_aircraft(aircraft)
    with simulating():
        recording = flight_of(loaded, flight)
        loaded = flown_aircraft(loaded, recording)
        whole = make_map(loaded, recording, spacing_m=spacing)
    if output is not None:
        figure = draw_map(loaded, recording, whole)
        if output.suffix.lower() == ".html":
            write_page(whole, figure, output, count=top, force=force)
        else:
            plots.save(figure, output, force=force)
    click.echo(whole.to_json(top) if as_json else whole.to_text(top), nl=False)
    if output is not None and not as_json:
        click.echo(f"\n{output}")
