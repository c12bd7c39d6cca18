"""``magsim train``: fit a compensator on recordings and keep it in a folder."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from magsim.compensation import Compensator
    from magsim.recording import Recording

RUN, CHECKPOINT = "run.json", "checkpoint"


@click.command(short_help="Train a compensator on recordings.")
@click.argument("method")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="The run; default ./runs/<method>"
)
@click.option("--preset", metavar="NAME", help="Set of parameters of the method: demo, cpu or paper for networks.")
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option("--seed", type=click.IntRange(min=0), help="Seed of all random choices; default 0.")
@click.option("--resume", is_flag=True, help="Go on with a run that was broken off.")
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

    METHOD is a name such as tl16, magtcn or bp, with settings if need be (tl16_gradient:order=2:vertical=false), or a
    TOML file with the keys method, preset, seed, sensor and a table [params]; options win over the file. The rows with
    split train are learned, those with split valid may guide or be learned too, those with split test are never looked
    at.
    """
    from magsim.cli.progress import training
    from magsim.compensation import create
    from magsim.errors import MagsimError

    asked = _asked(method)
    given = {"preset": preset, "sensor": sensor, "seed": seed}
    asked |= {name: value for name, value in given.items() if value is not None}
    compensator = create(asked["method"], preset=asked["preset"], **asked["params"])
    folder = output or Path("runs") / asked["method"]
    parts = _load(recordings)
    chosen = asked["sensor"] or next(iter(parts[0][0].scalars), "")
    run = _describe(compensator, asked, chosen, parts)
    if _prepare(folder, run, resume=resume, force=force):
        click.echo(f"{folder}: this run is complete", err=True)
        return
    with training(quiet=quiet) as progress:
        extra: dict[str, Any] = {}
        if compensator.resumable:
            extra = {"progress": progress, "checkpoint": folder / CHECKPOINT}
        fit, valid = ([r for r in side if r is not None] for side in zip(*(p[1:] for p in parts), strict=True))
        try:
            compensator.fit(fit, sensor=chosen, valid=valid, seed=asked["seed"], **extra)
        except MagsimError:
            _undo(folder)
            raise
    compensator.save(folder)
    _remove_checkpoint(folder)
    report = getattr(compensator, "report_", None)
    if report is not None and not quiet:
        click.echo(str(report))
    click.echo(f"{folder}: {compensator.name} for {chosen}, {sum(len(r) for r in (*fit, *valid))} rows")


def _asked(method: str) -> dict[str, Any]:
    """Method, preset, seed, sensor and parameters, from a name with settings or a TOML file."""
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
    config = document.validate(create_model("Training", __base__=Strict, **fields))
    params = config.params if isinstance(config.params, dict) else config.params.model_dump(exclude_unset=True)
    return {name: getattr(config, name) for name in ("method", "preset", "seed", "sensor")} | {"params": params}


def _load(paths: Sequence[Path]) -> list[tuple["Recording", "Recording | None", "Recording | None"]]:
    """Each recording with its labeled training and validation rows."""
    from magsim import columns
    from magsim.errors import RequestError
    from magsim.recording import read_recordings

    out = []
    for recording in (recording for path in paths for recording in read_recordings(path)):
        if columns.SPLIT.pattern not in recording:
            msg = (
                f"recording {recording.name!r} has no column 'split', which tells training rows from test rows; "
                "magsim import makes it with --train and --test"
            )
            raise RequestError(msg)
        masks = [recording.mask(split=split) for split in ("train", "valid")]
        sides = [recording.take(mask).labeled() if mask.sum() >= 2 else None for mask in masks]
        out.append((recording, *sides))
    if all(train is None for _, train, _ in out):
        names = ", ".join(repr(recording.name) for recording, _, _ in out)
        msg = f"no training rows: no row of {names} has split = train"
        raise RequestError(msg)
    return out


def _describe(
    compensator: "Compensator",
    asked: dict[str, Any],
    sensor: str,
    parts: Sequence[tuple["Recording", "Recording | None", "Recording | None"]],
) -> dict[str, Any]:
    """What a run is made of: settings and the exact rows, without paths, so that two machines agree."""
    import hashlib

    from magsim import __version__

    rows = []
    for recording, *sides in parts:
        entry: dict[str, Any] = {"recording": recording.name}
        for split, side in zip(("train", "valid"), sides, strict=True):
            if side is not None:
                digest = hashlib.sha256(side.time_s.tobytes())
                for name in sorted(side.data):
                    digest.update(name.encode() + side[name].tobytes())
                spans = [[float(p.time_s[0]), float(p.time_s[-1]), len(p)] for p in side.pieces()]
                entry[split] = {"first_last_rows": spans, "sha256": digest.hexdigest()}
        rows.append(entry)
    return {
        "magsim": __version__,
        "method": asked["method"],
        "preset": asked["preset"],
        "params": json.loads(json.dumps(compensator.get_params())),
        "seed": asked["seed"],
        "sensor": sensor,
        "rows": rows,
    }


def _prepare(folder: Path, run: dict[str, Any], *, resume: bool, force: bool) -> bool:
    """Make the folder ready for a run; true where the run is there and complete.

    Raises
    ------
    RequestError
        If the folder holds a run that must not be touched, or none that could be resumed.
    """
    from magsim.compensation.base import ARRAYS, SETTINGS
    from magsim.errors import RequestError
    from magsim.storage import atomic_write

    there = (folder / RUN).exists()
    if resume and not there:
        msg = f"{folder} holds no run to resume"
        raise RequestError(msg)
    if resume and not force:
        if _read_run(folder / RUN) != run:
            msg = (
                f"{folder} holds a run with other settings or recordings, which cannot be resumed; --force replaces it"
            )
            raise RequestError(msg)
        return (folder / SETTINGS).exists()
    if folder.exists() and not force and (there or any(folder.iterdir() if folder.is_dir() else [folder])):
        what = "a run" if there else "files"
        msg = (
            f"{folder} holds {what} already: --resume goes on with a run, --force replaces it, -o names another folder"
        )
        raise RequestError(msg)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot make the folder {folder}: {error.strerror}"
        raise RequestError(msg) from None
    for name in (SETTINGS, ARRAYS, "weights.safetensors", RUN):
        (folder / name).unlink(missing_ok=True)
    _remove_checkpoint(folder)
    text = json.dumps(run, indent=1, sort_keys=True) + "\n"
    atomic_write(folder / RUN, lambda path: path.write_text(text, encoding="utf-8"), force=True)
    return False


def _read_run(path: Path) -> object:
    from magsim.errors import DataError

    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"{path} is broken: {error}"
        raise DataError(msg) from None


def _undo(folder: Path) -> None:
    """Leave nothing of a run that failed before it had anything to resume."""
    if not (folder / CHECKPOINT).exists():
        (folder / RUN).unlink(missing_ok=True)
        _remove_empty(folder)


def _remove_checkpoint(folder: Path) -> None:
    """Remove the states of the training runs, and nothing else that may lie there."""
    for phase in sorted((folder / CHECKPOINT).glob("*/")):
        for path in phase.glob("step_*"):
            path.unlink()
        _remove_empty(phase)
    _remove_empty(folder / CHECKPOINT)


def _remove_empty(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
