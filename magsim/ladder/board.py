"""The board of a run: who stands where on each track and level, and the files that say so.

``scores.csv`` (and ``scores.parquet``) has every score, ``entered.csv`` what became of each method on each set,
``standings.csv`` the tables, ``report.json`` the tables with all that they were made of; ``board.md`` and
``board.html`` are for people. Scores and standings are the same again to the
last digit; times are not.
"""

import csv
import io
import json
import os
import platform
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from magsim.benchmark.contest import sandbox
from magsim.benchmark.gates import Scores, gate_failures
from magsim.benchmark.statistics import Standing, standings
from magsim.ladder.baselines import BASELINES
from magsim.ladder.definition import Ladder
from magsim.ladder.results import Entered, Score, plain
from magsim.ladder.tracks import TRACKS
from magsim.storage import atomic_text, atomic_write

RAW, FLOOR = "none", "noise_floor"

LIBRARIES = ("numpy", "scipy", "numba", "jsbsim", "torch", "h5py")


@dataclass(frozen=True)
class Table:
    """One track, level and magnetometer.

    Attributes
    ----------
    track, level, sensor : str
    sets : int
    standings : tuple of Standing
        The noise floor is not among them.
    floor_ir : float
        Improvement ratio of a perfect estimate: the ceiling.
    flights : mapping
        Improvement ratio by method and flight, geometric means over sets.
    costs : mapping
        Medians over sets by method, as ``Entered`` names them.
    marks : mapping
        By method: ``adaptive``, ``pretrained``.
    lost : mapping
        Methods without a score, or without one in some sets, and the first reason.
    """

    track: str
    level: str
    sensor: str
    sets: int
    standings: tuple[Standing, ...]
    floor_ir: float
    flights: Mapping[str, Mapping[str, float]]
    costs: Mapping[str, Mapping[str, float]]
    marks: Mapping[str, tuple[str, ...]]
    lost: Mapping[str, str]


@dataclass(frozen=True)
class Board:
    """All tables of a run."""

    about: Mapping[str, object]
    ladder: Ladder
    tables: tuple[Table, ...]
    scores: Sequence[Score]
    entered: Sequence[Entered]

    def write(self, folder: Path) -> None:
        """Write all files into a folder, in place of those that are there."""
        from magsim.ladder import pages

        atomic_text(folder / "scores.csv", _csv(Score._fields, self.scores), force=True)
        rows = [one._replace(requires=" ".join(one.requires), learned=" ".join(one.learned)) for one in self.entered]  # type: ignore[arg-type]
        atomic_text(folder / "entered.csv", _csv(Entered._fields, rows), force=True)
        if find_spec("pyarrow"):
            import pandas as pd

            frame = pd.DataFrame(self.scores, columns=list(Score._fields))
            atomic_write(folder / "scores.parquet", lambda path: frame.to_parquet(path, index=False), force=True)
        lines = [line for table in self.tables for line in _flat(table)]
        atomic_text(
            folder / "standings.csv", _csv(list(lines[0]) if lines else [], [one.values() for one in lines]), force=True
        )
        report = {
            "about": {**self.about, "environment": environment()},
            "tables": [asdict(table) for table in self.tables],
        }
        atomic_text(folder / "report.json", json.dumps(_strict(report), indent=1, allow_nan=False) + "\n", force=True)
        atomic_text(folder / "board.md", pages.markdown(self), force=True)
        atomic_text(folder / "board.html", pages.html(self), force=True)


def make_board(
    about: Mapping[str, object], ladder: Ladder, scores: Sequence[Score], entered: Sequence[Entered]
) -> Board:
    """Rank all methods on each track and level."""
    groups: dict[tuple[str, str, str], list[Score]] = defaultdict(list)
    for score in scores:
        groups[score.track, score.level, score.sensor].append(score)
    told: dict[tuple[str, str, str], list[Entered]] = defaultdict(list)
    for one in entered:
        told[one.track, one.level, one.sensor].append(one)
    tables = tuple(_table(*key, rows, told[key]) for key, rows in groups.items())
    return Board(about, ladder, tables, scores, entered)


def _table(track: str, level: str, sensor: str, scores: Sequence[Score], entered: Sequence[Entered]) -> Table:
    """Rank the methods of one table."""
    of = TRACKS[track].baseline
    numbers = sorted({score.set for score in scores})
    whole: dict[str, dict[int, dict[str, float]]] = defaultdict(lambda: defaultdict(dict))
    parts: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for score in scores:
        if score.segment != "test":
            continue
        if score.flight == "all":
            whole[score.method][score.set][score.metric] = score.value
        elif score.metric == "ir":
            parts[score.method][score.flight].append(score.value)
    std_nt = {name: _by_set(found, "std_nt", numbers) for name, found in whole.items()}
    own = [one for one in entered if one.status == "ok"]
    marks = {
        name: tuple(
            word
            for word, has in (
                ("adaptive", any(one.adapts for one in own if one.method == name)),
                ("pretrained", any(one.pretrained for one in own if one.method == name)),
            )
            if has
        )
        for name in whole
    }
    baseline = whole.get(of, {})
    failed = {
        name: gate_failures(
            [*found.values()],
            [baseline[number] for number in found if number in baseline],
            adaptive="adaptive" in marks[name],
        )
        for name, found in whole.items()
    }
    raw, floor = std_nt[RAW], std_nt[FLOOR]
    ranked = {name: values for name, values in std_nt.items() if name not in (RAW, FLOOR)}
    lost = {one.method: f"{one.status}: {one.reason}" for one in reversed(entered) if one.status != "ok"}
    return Table(
        track,
        level,
        sensor,
        len(numbers),
        tuple(standings(ranked, raw, floor, baseline=of, failed=failed)),
        float(np.exp(np.nanmean(np.log(raw / floor)))),
        {name: {flight: _geometric(values) for flight, values in found.items()} for name, found in parts.items()},
        {name: _costs([one for one in own if one.method == name]) for name in ranked if name not in BASELINES},
        marks,
        lost,
    )


def _by_set(found: Mapping[int, Scores], metric: str, numbers: Sequence[int]) -> np.ndarray:
    return np.array([found.get(number, {}).get(metric, np.nan) for number in numbers])


def _geometric(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))


def _costs(entered: Sequence[Entered]) -> dict[str, float]:
    names = ("fit_cpu_s", "estimate_us", "peak_mb", "state_bytes", "parameters")
    return {name: float(np.median([getattr(one, name) for one in entered])) for name in names} if entered else {}


def _flat(table: Table) -> Iterable[dict[str, object]]:
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
