"""``magsim train``: fit a compensator on recordings and keep it in a folder."""

from pathlib import Path
from typing import Any

import click


@click.command(short_help="Train a compensator on recordings.")
@click.argument("method")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="The run; default ./runs/<method>"
)
@click.option("--preset", metavar="NAME", help="Set of parameters of the method: default, quick or paper for networks.")
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all random choices; default 0.")
@click.option("--resume", is_flag=True, help="Continue a run that was broken off.")
@click.option("--force", is_flag=True, help="Replace an existing run.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def train(  # noqa: PLR0917 - the options
    method: str,
    recordings: tuple[Path, ...],
    output: Path | None,
    preset: str | None,
    sensor: str | None,
    seed: int | None,
    resume: bool,
    force: bool,
    quiet: bool,
) -> None:
    """Train METHOD on RECORDINGS: files, or folders of them.

    METHOD is a name such as tl16, magtcn or bp, with settings if need be (tl16_gradient:order=2:vertical=false); a
    class of your own or a torch module, my_file.py:MyMethod; or a TOML file with the keys method, preset, seed, sensor
    and a table [params]; options win over the file. The rows with split train are learned, those with split valid may
    guide or be learned too, those with split test are never looked at. Recordings without a split are learned whole.
    """
    from magsim.cli.progress import training as display
    from magsim.compensation import FitContext, create
    from magsim.compensation.runs import Run, fingerprint
    from magsim.dataset import flights_of, read_training

    asked = _asked(method)
    given = {"preset": preset, "sensor": sensor, "seed": seed}
    asked |= {name: value for name, value in given.items() if value is not None}
    compensator = create(asked["method"], preset=asked["preset"], **asked["params"])
    folder = output or Path("runs") / asked["method"].rpartition(":")[2]
    rows = read_training(flights_of(recordings), asked["sensor"])
    made_of = fingerprint(compensator, rows, preset=asked["preset"], seed=asked["seed"])
    run = Run.open(folder, made_of, resume=resume, force=force)
    if run.is_complete:
        click.echo(f"{folder}: this run is complete", err=True)
        return
    with display(quiet=quiet) as progress:
        run.train(compensator, rows, FitContext(asked["seed"], progress))
    report = getattr(compensator, "report_", None)
    if report is not None and not quiet:
        click.echo(str(report))
    click.echo(f"{folder}: {compensator.name} for {rows.sensor}, {sum(rows.rows.values())} rows")


def _asked(method: str) -> dict[str, Any]:
    """Return method, preset, seed, sensor and parameters, from a name with settings or a TOML file."""
    if not method.endswith(".toml"):
        from magsim.compensation import parse_method

        name, params = parse_method(method)
        preset = params.pop("preset", None)
        return {"method": name, "preset": preset, "seed": 0, "sensor": None, "params": params}
    from typing import Annotated, Literal

    from pydantic import Field, create_model

    from magsim.compensation.registry import lookup, names
    from magsim.config import Name, Strict, read

    document = read(Path(method))
    fields: dict[str, Any] = {
        "method": (Literal[names()], ...),
        "preset": (str | None, None),
        "seed": (Annotated[int, Field(ge=0)], 0),
        "sensor": (Name | None, None),
    }
    head = document.table.get("method")
    if isinstance(head, str) and head in names():
        settings = lookup(head).load().settings_model()
        fields["params"] = (settings, settings())
    else:
        fields["params"] = (dict, {})
    config: Any = document.validate(create_model("Training", __base__=Strict, **fields))
    params = config.params if isinstance(config.params, dict) else config.params.model_dump(exclude_unset=True)
    return {name: getattr(config, name) for name in ("method", "preset", "seed", "sensor")} | {"params": params}
