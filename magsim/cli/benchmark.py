"""``magsim benchmark``: compare compensators on recordings."""

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magsim.benchmark.metrics import STANDARD, WITH_TABLE
from magsim.cli.ladder import LadderOptions, run_ladder, with_ladder_options
from magsim.errors import RequestError

if TYPE_CHECKING:
    from magsim.benchmark import Report
    from magsim.compensation import Compensator

DEFAULT = "none,tl16,tl18,noise_floor"


@click.command(short_help="Compare compensators on recordings.")
@click.argument("recordings", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--methods",
    metavar="LIST",
    help="Names of methods, name:key=value:... for settings, your own classes as my_file.py:MyMethod, and folders of "
    "trained runs, with commas between them; all: every method that the "
    f"recordings suffice for. Default {DEFAULT}; on the ladder all closed forms and two networks.",
)
@click.option("--quick", is_flag=True, help="Networks for a first look: the preset quick of methods that have one.")
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer; default the first one.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    help="Seed of the fits, default 0; with --ladder that of its sets, by default the public one.",
)
@click.option(
    "--scores",
    metavar="LIST",
    help=f"Metrics with a table by heading and maneuver, of {', '.join(WITH_TABLE)}; default {','.join(STANDARD)}.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    type=click.Path(path_type=Path),
    help="Write report.json, table.txt and table.csv there.",
)
@click.option("--force", is_flag=True, help="Replace an existing report.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
@with_ladder_options
def benchmark(  # noqa: PLR0917 - the options
    recordings: tuple[Path, ...],
    methods: str | None,
    quick: bool,
    sensor: str | None,
    seed: int | None,
    scores: str | None,
    as_json: bool,
    output: Path | None,
    force: bool,
    quiet: bool,
    **asked: Any,
) -> None:
    """Fit methods on the training rows of RECORDINGS and judge them on the test rows, against the truth.

    RECORDINGS are files or folders; without any, those of the current folder. What belongs together is fitted together:
    the groups of a data set; else the flights of a file, if every file holds training and test rows; else all that was
    given. A trained run (see magsim train) is judged without fitting it again.
    """
    from magsim.benchmark import evaluate
    from magsim.benchmark.metrics import check_scores

    options = LadderOptions(**asked)
    if options.ladder:
        if recordings or sensor or scores or force:
            msg = "--ladder flies its own recordings; RECORDINGS, --sensor, --scores and --force do not go with it"
            raise RequestError(msg)
        named = None if methods is None else _listed(methods)
        run_ladder(options, named, seed=seed, quick=quick, output=output, as_json=as_json, quiet=quiet)
        return
    if options.given:
        msg = f"{', '.join(options.given)} is for the ladder; add --ladder"
        raise RequestError(msg)
    seed = seed or 0
    chosen = _methods(methods or DEFAULT)
    tables = None if scores is None else [score.strip() for score in scores.split(",") if score.strip()]
    if tables is not None:
        check_scores(tables)
    if output is not None:
        _check_folder(output, force=force)
    progress = None if quiet else lambda line: click.echo(line, err=True)
    report = evaluate(recordings or (Path(),), chosen, sensor=sensor, seed=seed, quick=quick, progress=progress)
    if output is not None:
        _write(report, output, tables)
    click.echo(report.to_json() if as_json else report.to_text(scores=tables), nl=False)


def _listed(text: str) -> list[str]:
    """Return the methods of a list as typed; a comma inside of brackets is one of a list: ``bp:hidden=[32,32]``."""
    asked = [name.strip() for name in re.split(r",(?![^\[\]]*\])", text) if name.strip()]
    if not asked:
        msg = "--methods: no method is named"
        raise RequestError(msg)
    return asked


def _methods(text: str) -> "list[str | Compensator | tuple[str, Compensator]]":
    """Return methods of the registry as typed, and trained runs by their folders, named by their last part."""
    from magsim.benchmark import ALL, NOISE_FLOOR
    from magsim.compensation import load, make, names

    asked = _listed(text)
    known = (*names(), NOISE_FLOOR, ALL)
    files = [".py:" in name for name in asked]
    folders = [
        not file and name.partition(":")[0].strip() not in known and (Path(name).is_dir() or "/" in name)
        for name, file in zip(asked, files, strict=True)
    ]
    short = [
        _last_part(name) if file or folder else name for name, file, folder in zip(asked, files, folders, strict=True)
    ]
    # classes of files first: a trained run may be one of them
    own = {name: make(name) for name, file in zip(asked, files, strict=True) if file}
    out: list[str | Compensator | tuple[str, Compensator]] = []
    for name, title, folder in zip(asked, short, folders, strict=True):
        shown = title if short.count(title) == 1 else name
        if folder:
            out.append((shown, load(name)))
        else:
            out.append((shown, own[name]) if name in own else name)
    return out


def _last_part(name: str) -> str:
    """Return a name for tables without the folders before it; settings of a class in a file stay."""
    path, file, rest = name.partition(".py:")
    return f"{Path(path).name}{file}{rest}" or name


def _check_folder(folder: Path, *, force: bool) -> None:
    from magsim.storage import check_target

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"cannot make the folder {folder}: {error.strerror}"
        raise RequestError(msg) from None
    for name in ("report.json", "table.txt", "table.csv"):
        check_target(folder / name, force=force)


def _write(report: "Report", folder: Path, scores: list[str] | None) -> None:
    """Write the report in three forms, the same bytes for the same data."""
    from magsim.storage import atomic_write

    texts = {
        "report.json": report.to_json(),
        "table.txt": report.to_text(times=False, scores=scores),
        "table.csv": report.to_frame().to_csv(index=False, lineterminator="\n"),
    }
    for name, text in texts.items():
        # the folder was checked before the work began
        atomic_write(folder / name, partial(Path.write_text, data=text, encoding="utf-8"), force=True)
