"""``magsim train``: fit a compensator on recordings and keep it in a folder."""

import math
import os
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from magsim.compensation import Compensator
    from magsim.dataset import Training
    from magsim.training import Progress

DEFAULTS: dict[str, Any] = {
    "preset": None, "seed": 0, "sensor": None, "device": "cpu", "precision": "float32", "deterministic": True,
    "tensorboard": False, "init": None, "freeze": [], "seeds": [],
}  # fmt: skip
"""Keys of a training beside its method and parameters."""


def _seeds(_context: click.Context, _option: click.Parameter, text: str | None) -> tuple[int, ...] | None:
    """Return the seeds of a list such as 0,1,2."""
    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts) or len(set(map(int, parts))) < len(parts):
        msg = f"{text!r} is not allowed; allowed: whole numbers of 0 or more by comma, none of them twice, as in 0,1,2"
        raise click.BadParameter(msg)
    return tuple(map(int, parts))


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
@click.option("--device", metavar="NAME", help="Where networks train: cpu, cuda, cuda:1, ..., auto; default cpu.")
@click.option("--precision", type=click.Choice(["float32", "bf16"]), help="Of matrix products; bf16 on CUDA alone.")
@click.option("--deterministic/--no-deterministic", default=None, help="Refuse what gives other bits each time.")
@click.option("--tensorboard", is_flag=True, default=None, help="Write event files for TensorBoard beside log.csv.")
@click.option("--init", metavar="RUN", type=click.Path(path_type=Path), help="Start from the weights of another run.")
@click.option("--freeze", metavar="PATTERN", multiple=True, help="Keep these parameters as in --init, as 'blocks.*'.")
@click.option("--seeds", metavar="LIST", callback=_seeds, help="Train once for each: 0,1,2; runs in FOLDER/seed_0, ...")
@click.option("--workers", type=click.IntRange(min=1), help="Trainings at a time with --seeds; default one a core.")
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
    device: str | None,
    precision: str | None,
    deterministic: bool | None,
    tensorboard: bool | None,
    init: Path | None,
    freeze: tuple[str, ...],
    seeds: tuple[int, ...] | None,
    workers: int | None,
    quiet: bool,
) -> None:
    """Train METHOD on RECORDINGS: files, or folders of them.

    METHOD is a name such as tl16, magtcn or bp, with settings if need be (tl16_gradient:order=2:vertical=false); a
    class of your own or a torch module, my_file.py:MyMethod; or a TOML file with the key method, a table [params] and
    the names of these options as keys; options win over the file. The rows with split train are learned, those with
    split valid may guide or be learned too, those with split test are never looked at. Recordings without a split are
    learned whole. Under torchrun the processes share each batch.
    """
    from magsim.compensation import create

    asked = asked_training(method)
    given = {
        "preset": preset, "sensor": sensor, "seed": seed, "device": device, "precision": precision,
        "deterministic": deterministic, "tensorboard": tensorboard, "init": init, "freeze": freeze or None,
        "seeds": seeds,
    }  # fmt: skip
    asked |= {name: value for name, value in given.items() if value is not None}
    if seed is not None and seeds is None:
        asked["seeds"] = ()
    compensator = create(asked["method"], preset=asked["preset"], **asked["params"])
    folder = output or Path("runs") / asked["method"].rpartition(":")[2]
    if asked["seeds"]:
        _check_seeds(compensator, seed)
        from magsim.cli.seeds import train_seeds

        del given["seeds"]
        words = [method, *map(str, recordings), *_words({**given, "force": force, "quiet": quiet})]
        train_seeds(words, asked["seeds"], folder, workers=workers, resume=resume)
        return
    if workers is not None:
        msg = f"--workers {workers} has no effect without --seeds"
        raise click.UsageError(msg)
    _train_one(compensator, recordings, asked, folder, resume=resume, force=force, quiet=quiet)


def _train_one(
    compensator: "Compensator",
    recordings: tuple[Path, ...],
    asked: dict[str, Any],
    folder: Path,
    *,
    resume: bool,
    force: bool,
    quiet: bool,
) -> None:
    from magsim.cli.progress import training as display
    from magsim.compensation import FitContext
    from magsim.compensation.runs import Run, fingerprint
    from magsim.dataset import flights_of

    context = FitContext(
        asked["seed"],
        device=asked["device"],
        precision=asked["precision"],
        deterministic=asked["deterministic"],
        logs=folder if compensator.trains else None,
        tensorboard=asked["tensorboard"],
        init=asked["init"] and Path(asked["init"]),
        freeze=tuple(asked["freeze"]),
    )
    if not compensator.trains:
        context.refuse_without_effect(compensator.name)
    rows = compensator.read_rows(flights_of(recordings), asked["sensor"])
    about = {"preset": asked["preset"], "seed": asked["seed"], "context": context}
    first = os.environ.get("RANK", "0") == "0"  # of the processes of torchrun
    with display(quiet=quiet or not first) as progress:
        made_of = fingerprint(compensator, _counted(rows, "checksums", progress), **about)
        run = Run.shared(folder, made_of, resume=resume, force=force)
        if not run.is_complete:
            run.train(compensator, _counted(rows, "stages", progress), replace(context, progress=progress))
    if run.is_complete:
        click.echo(f"{folder}: this run is complete", err=True)
        return
    if not run.writes:
        return
    report = getattr(compensator, "report_", None)
    if report is not None and not quiet:
        click.echo(str(report))
    click.echo(f"{folder}: {compensator.name} for {rows.sensor}, {sum(rows.rows.values())} rows")


def _counted(rows: "Training", phase: str, report: Callable[["Progress"], None]) -> "Training":
    """Report every flight that is read of those that are not in memory: of thousands it takes minutes."""
    from magsim.dataset import OneByOne

    if not isinstance(rows, OneByOne):
        return rows
    from magsim.training import Progress

    read, unknown = count(1), math.nan

    def check(_recording: object) -> None:
        step = min(next(read), len(rows.recordings))
        report(Progress(phase, step, len(rows.recordings), unknown, unknown, unknown, unknown, unknown, unknown))

    return rows.checked(check)


def _words(options: dict[str, Any]) -> list[str]:
    """Return options as they are written on the command line."""
    out = []
    for name, value in options.items():
        if name == "deterministic" and value is False:
            out.append("--no-deterministic")
        elif value is True:
            out.append(f"--{name}")
        elif value is not None and value is not False:
            each = value if isinstance(value, tuple) else (value,)
            out += [word for one in each for word in (f"--{name}", str(one))]
    return out


def _check_seeds(compensator: "Compensator", seed: int | None) -> None:
    """Refuse several seeds where they have no effect, or cannot be."""
    if seed is not None:
        msg = f"--seed {seed} and --seeds exclude each other"
    elif not compensator.trains:
        msg = f"--seeds has no effect: method {compensator.name} is not trained in steps"
    elif "WORLD_SIZE" in os.environ:
        msg = "--seeds starts processes of its own, and does not go with torchrun; allowed: --seed"
    else:
        return
    raise click.UsageError(msg)


def asked_training(method: str) -> dict[str, Any]:
    """Return what is asked for by a name with settings, or by a TOML file: all keys, with their defaults."""
    if not method.endswith(".toml"):
        from magsim.compensation import parse_method

        name, params = parse_method(method)
        return {**DEFAULTS, "method": name, "preset": params.pop("preset", None), "params": params}
    from typing import Annotated, Literal

    from pydantic import Field, create_model

    from magsim.compensation.registry import lookup, names
    from magsim.config import Name, Strict, read

    document = read(Path(method))
    seed = Annotated[int, Field(ge=0)]
    types: dict[str, Any] = {
        "preset": str | None,
        "seed": seed,
        "sensor": Name | None,
        "device": Annotated[str, Field(pattern=r"^(cpu|auto|cuda(:[0-9]+)?)$")],
        "precision": Literal["float32", "bf16"],
        "deterministic": bool,
        "tensorboard": bool,
        "init": str | None,
        "freeze": list[str],
        "seeds": list[seed],
    }
    fields: dict[str, Any] = {"method": (Literal[names()], ...)}
    fields |= {name: (kind, DEFAULTS[name]) for name, kind in types.items()}
    head = document.table.get("method")
    if isinstance(head, str) and head in names():
        settings = lookup(head).load().settings_model()
        fields["params"] = (settings, settings())
    else:
        fields["params"] = (dict, {})
    config: Any = document.validate(create_model("Training", __base__=Strict, **fields))
    params = config.params if isinstance(config.params, dict) else config.params.model_dump(exclude_unset=True)
    return {name: getattr(config, name) for name in ("method", *types)} | {"params": params}
