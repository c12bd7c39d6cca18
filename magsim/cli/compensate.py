"""``magsim compensate``: a survey file, or lines as they come, with the compensated reading beside the others."""

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from magsim.errors import RequestError

if TYPE_CHECKING:
    from magsim.compensation import Compensator
    from magsim.compensation.streaming import Stream
    from magsim.exchange.compensating import PickedLines, SurveyFile

FORMATS = ("recording", "mit", "sgl-xyz", "xyz", "csv")


@click.command(short_help="Compensate a survey file, or lines as they come.")
@click.argument("model")
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Default ./<name>_compensated.<ending>, or standard output.",
)
@click.option("--lines", metavar="LIST", help="PickedLines to compensate, as in 1001,1003-1010; default all rows.")
@click.option("--calibrate", metavar="LIST", help="PickedLines to fit first: MODEL is then the name of a method.")
@click.option("--sensor", metavar="NAME", help="Scalar magnetometer to fit with --calibrate; default the first one.")
@click.option("--save", metavar="FOLDER", type=click.Path(path_type=Path), help="Keep what --calibrate fitted.")
@click.option(
    "--format", "kind", type=click.Choice(FORMATS), help="Default: according to FILE; csv for standard input."
)
@click.option("--map", "column_map", metavar="FILE", type=click.Path(path_type=Path), help="TOML file of column names.")
@click.option("--rate", "rate_hz", metavar="HZ", type=float, help="Rows a second of standard input; default as fitted.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def compensate(  # noqa: PLR0917 - the options
    model: str,
    file: Path,
    output: Path | None,
    lines: str | None,
    calibrate: str | None,
    sensor: str | None,
    save: Path | None,
    kind: str | None,
    column_map: Path | None,
    rate_hz: float | None,
    force: bool,
) -> None:
    """Write FILE again with two more columns: the compensated reading, and what was removed from it.

    \b
    magsim compensate runs/x survey.csv --map survey.toml --lines 2000-2600 -o clean.csv
    magsim compensate tl16_measured survey.xyz --calibrate 101-104 --lines 200-260
    logger | magsim compensate runs/x - --map logger.toml

    MODEL is the folder of a fitted method (magsim train), or with --calibrate the name of one, with settings if need
    be, which is fitted on those lines of FILE first. FILE is a recording, or what magsim import reads. All other
    columns stay as they are, in a text to the byte. Rows on other lines, or without a value that the method needs, get
    a missing value; of a recording, which holds none, they are left out.

    FILE may be - for standard input: each line is written as soon as its estimate is there.
    """  # noqa: D301 - \b is for click
    given = {"--calibrate": calibrate, "--sensor": sensor, "--save": save, "--rate": rate_hz, "--format": kind}
    picked = _lines(lines, "--lines")
    if str(file) == "-":
        _refuse(given, ("--calibrate", "--sensor", "--save"), "standard input: lines to fit must be in a file")
        read = _reader_of_stdin(model, kind or "csv", column_map, lines=picked, rate_hz=rate_hz)
        _write_stdin(read, output, force=force)
        return
    _refuse(given, ("--rate",), "a file: its own times tell it")
    if calibrate is None:
        _refuse(given, ("--sensor", "--save"), "a method that is fitted already, without --calibrate")
    from magsim import storage
    from magsim.exchange import compensating

    target = output or Path(f"{file.stem}_compensated{file.suffix}")
    storage.check_target(target, force=force)
    if target.exists() and file.exists() and target.samefile(file):
        msg = f"{target} is the file that is read; give another path with -o"
        raise RequestError(msg)
    to_fit = _lines(calibrate, "--calibrate")
    method, found = _read(model, file, kind=kind, column_map=column_map, lines=to_fit, sensor=sensor)
    values = compensating.compensate(method, found.surveys, picked, "--lines")
    left_out = compensating.write_compensated(found, values, method.sensor_, target, force=force)
    if save is not None:
        method.save(save, force=force)
    if left_out:
        click.echo(f"left out, having no estimate: {left_out} rows", err=True)
    rows = np.concatenate(values)
    done = np.isfinite(rows[:, 0])
    click.echo(f"{target}: {done.sum()} of {len(rows)} rows compensated, {rows[done, 1].std():.4g} nT (STD) removed")


def _read(
    model: str,
    file: Path,
    *,
    kind: str | None,
    column_map: Path | None,
    lines: "PickedLines | None",
    sensor: str | None,
) -> "tuple[Compensator, SurveyFile]":
    """Return the method, fitted on lines of the file if there are any, and the file."""
    from magsim.columns import MAG
    from magsim.compensation import load, make
    from magsim.exchange import compensating

    mapping = compensating.read_map(column_map)
    if lines is not None:
        method = make(model)
        found = compensating.read_survey(file, kind, mapping)
        return compensating.calibrate(method, found.surveys, lines, sensor, "--calibrate"), found
    method = load(model)
    reading = MAG.name(sensor=method.sensor_)
    found = compensating.read_survey(file, kind, mapping, lambda has: {*method.input_columns(has), reading})
    return method, found


Write = Callable[[bytes], object]
"""Takes a line of the answer."""


def _reader_of_stdin(
    model: str, kind: str, column_map: Path | None, *, lines: "PickedLines | None", rate_hz: float | None
) -> Callable[[Write], object]:
    """Return what compensates the lines of standard input as they come."""
    from magsim.compensation import load
    from magsim.exchange import compensating

    if kind in ("recording", "mit"):
        msg = f"--format {kind}: standard input is text; allowed: csv, xyz, sgl-xyz"
        raise RequestError(msg)
    method, mapping = load(model), compensating.read_map(column_map)
    if not method.causal:
        method.stream()  # tells why there is none, before anything is read

    def make(start_utc: str | None) -> "Stream":
        return method.stream(rate_hz=rate_hz, start_utc=start_utc)

    def read(write: Write) -> object:
        feed = compensating.LineFeed(make, kind, mapping, write, lines=lines)
        return feed.run(sys.stdin.buffer)

    return read


def _write_stdin(read: Callable[[Write], object], output: Path | None, *, force: bool) -> None:
    """Write to standard output, each line at once, or to a file that is whole at the end or absent."""
    if output is None:
        stdout = sys.stdout.buffer

        def write(line: bytes) -> None:
            stdout.write(line)
            stdout.flush()

        read(write)
        return
    from magsim.storage import atomic_write, check_target

    check_target(output, force=force)

    def write_file(path: Path) -> None:
        with path.open("wb") as file:
            read(file.write)

    atomic_write(output, write_file, force=force)


def _lines(text: str | None, option: str) -> "PickedLines | None":
    from magsim.exchange.compensating import PickedLines

    return None if text is None else PickedLines.parse(text, option)


def _refuse(given: Mapping[str, object], options: Sequence[str], what: str) -> None:
    """Refuse options without effect."""
    useless = [option for option in options if given[option] is not None]
    if useless:
        msg = f"{', '.join(useless)} has no effect on {what}"
        raise RequestError(msg)
