"""``magsim observe``: what a calibration flight can tell, before it is flown or after."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from magsim.recording import Recording


@click.command(short_help="Tell what a calibration flight can know of an aircraft.")
@click.argument("flight", metavar="SCENARIO|FILE")
@click.argument("line", metavar="[LINE]", required=False)
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option("--fluxgate", metavar="NAME", help="Fluxgate; default the first one.")
@click.option("--terms", type=click.Choice(["3", "8", "16"]), default="16", show_default=True, help="Coefficients.")
@click.option(
    "--noise",
    metavar="NT",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Noise of the reading in 0.1 to 0.6 Hz; default what the truth says, else what the reading shows above 1 Hz.",
)
@click.option(
    "--goal",
    metavar="NT",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Error on the survey line that is good enough; default the noise.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")
@click.pass_context
def observe(  # noqa: PLR0917 - the options
    ctx: click.Context,
    flight: str,
    line: str | None,
    sensor: str | None,
    fluxgate: str | None,
    terms: str,
    noise: float | None,
    goal: float | None,
    as_json: bool,
) -> None:
    """Predict how well Tolles-Lawson coefficients can be known from a flight, and what to fly more of.

    SCENARIO is flown first; FILE is a recording, or a folder of them. LINE is another one, the survey line on which the
    compensated reading shall be good; by default straight level lines in light air on four headings. The prediction
    takes noise of the reading alone: what Tolles-Lawson cannot express, and geology, come on top. The exit code is 3
    where the coefficients are unobservable.
    """
    from magsim.diagnosis.observe import observe as predict
    from magsim.diagnosis.observe_text import to_json, to_text
    from magsim.errors import DataError

    found = predict(
        _flights(flight),
        sensor=sensor,
        fluxgate=fluxgate,
        terms=int(terms),  # type: ignore[arg-type] # one of the choices
        line=None if line is None else _flights(line),
        noise_nt=noise,
        goal_nt=goal,
    )
    click.echo(to_json(found) if as_json else to_text(found), nl=False)
    if not found.is_observable:
        ctx.exit(DataError.exit_code)


def _flights(named: str) -> "tuple[Recording, ...]":
    """Read recordings, or fly a scenario."""
    from magsim.recording import read_recordings

    if Path(named).suffix.lower() in {".h5", ".hdf5"} or Path(named).is_dir():
        return read_recordings(named)
    from magsim.cli.progress import simulating
    from magsim.loading import load_scenario
    from magsim.simulation import simulate

    loaded = load_scenario(named)
    with simulating() as progress:
        return (simulate(loaded, progress=progress),)
