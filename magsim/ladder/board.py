"""The board of a run: who stands where on each track and level."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from magsim.benchmark.gates import Scores, gate_failures
from magsim.benchmark.statistics import Standing, standings
from magsim.ladder.baselines import BASELINES
from magsim.ladder.definition import Ladder
from magsim.ladder.results import WHOLE, Entered, Score
from magsim.ladder.tracks import TRACKS

RAW, FLOOR = "none", "noise_floor"


@dataclass(frozen=True)
class LevelTable:
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
    tables: tuple[LevelTable, ...]
    scores: Sequence[Score]
    entered: Sequence[Entered]


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


def _table(track: str, level: str, sensor: str, scores: Sequence[Score], entered: Sequence[Entered]) -> LevelTable:
    """Rank the methods of one table."""
    of = TRACKS[track].baseline
    numbers = sorted({score.set for score in scores})
    whole: dict[str, dict[int, dict[str, float]]] = defaultdict(lambda: defaultdict(dict))
    parts: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for score in scores:
        if score.segment != "test":
            continue
        if score.flight == WHOLE:
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
    return LevelTable(
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
