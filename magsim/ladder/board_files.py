"""The files of a board.

``scores.csv`` (and ``scores.parquet``) has every score, ``sets.csv`` the main ones with a row for each method and set,
``entered.csv`` what became of each method on each set and what it cost, ``standings.csv`` the tables, ``report.json``
the tables with all that they were made of; ``board.md`` and ``board.html`` are for people. Scores and standings are
the same again to the last digit; times are not.
"""

import csv
import io
import json
import math
import os
import platform
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from magsim.benchmark.contest import sandbox
from magsim.ladder import pages
from magsim.ladder.board import Board, LevelTable
from magsim.ladder.results import WHOLE, Entered, Score, plain
from magsim.storage import atomic_text, atomic_write

LIBRARIES = ("numpy", "scipy", "numba", "jsbsim", "torch", "h5py")


def write_board(board: Board, folder: Path) -> None:
    """Write all files into a folder, in place of those that are there."""
    atomic_text(folder / "scores.csv", _csv(Score._fields, board.scores), force=True)
    rows = [one._replace(requires=" ".join(one.requires), learned=" ".join(one.learned)) for one in board.entered]  # type: ignore[arg-type]
    columns = ("track", "level", "sensor", "set", "method", *MAIN)
    atomic_text(folder / "sets.csv", _csv(columns, _by_set(board.scores)), force=True)
    atomic_text(folder / "entered.csv", _csv(Entered._fields, rows), force=True)
    if find_spec("pyarrow"):
        import pandas as pd

        frame = pd.DataFrame(board.scores, columns=list(Score._fields))
        atomic_write(folder / "scores.parquet", lambda path: frame.to_parquet(path, index=False), force=True)
    lines = [line for table in board.tables for line in _flat(table)]
    atomic_text(
        folder / "standings.csv", _csv(list(lines[0]) if lines else [], [one.values() for one in lines]), force=True
    )
    report = {
        "about": {**board.about, "environment": environment()},
        "tables": [asdict(table) for table in board.tables],
    }
    atomic_text(folder / "report.json", json.dumps(_strict(report), indent=1, allow_nan=False) + "\n", force=True)
    atomic_text(folder / "board.md", pages.markdown(board), force=True)
    atomic_text(folder / "board.html", pages.html(board), force=True)


MAIN = ("std_nt", "ir", "excess_pt", "rmse0_nt", "slow_nt", "gain_0.1", "gain_1", "gain_20", "distortion")
"""Metrics of ``sets.csv``."""


def _by_set(scores: Iterable[Score]) -> Iterable[tuple[object, ...]]:
    """Yield the main scores of all flights together, a row for each method and set."""
    rows: dict[tuple[object, ...], dict[str, float]] = {}
    for one in scores:
        if one.flight == WHOLE and one.metric in MAIN:
            rows.setdefault((one.track, one.level, one.sensor, one.set, one.method), {})[one.metric] = one.value
    for key, found in rows.items():
        yield (*key, *(found.get(metric, math.nan) for metric in MAIN))


def _flat(table: LevelTable) -> Iterable[dict[str, object]]:
    """Yield a line of ``standings.csv`` for each method."""
    for one in table.standings:
        line: dict[str, object] = {"track": table.track, "level": table.level, "sensor": table.sensor}
        for name, value in asdict(one).items():
            if isinstance(value, tuple) and hasattr(value, "_fields"):
                line |= {
                    f"{name}_{part}" if part != "value" else name: number
                    for part, number in zip(value._fields, value, strict=True)
                }
            else:
                line[name] = "; ".join(value) if isinstance(value, tuple) else value
        line |= {"marks": " ".join(table.marks.get(one.method, ())), "floor_ir": table.floor_ir}
        yield line


def _csv(columns: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_short(value) for value in row] for row in rows)
    return out.getvalue()


def _short(value: object) -> object:
    """Return a number as it is read back to 9 digits."""
    return f"{value:.9g}" if isinstance(value, float) else value


def _strict(value: object) -> object:
    """Return nested values for JSON, without NaN."""
    if isinstance(value, Mapping):
        return {str(key): _strict(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        if hasattr(value, "_asdict"):
            return _strict(value._asdict())
        return [_strict(one) for one in value]
    return plain(value)


def environment() -> dict[str, str]:
    """Return what scores were made with: Python, libraries, the kind of machine."""
    out = {"python": platform.python_version(), "machine": platform.machine(), "system": platform.system()}
    out["cores"] = str(os.cpu_count())
    out["landlock"] = str(sandbox.level())
    for name in LIBRARIES:
        try:
            out[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return out
