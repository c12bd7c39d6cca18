"""One set of a ladder: flown in memory, every method judged on every level and track, written at the end."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from magsim.benchmark.contest import Allowance, Contest, Contestant, Finish
from magsim.benchmark.judging import LONGEST_WARMUP_S, residuals_of
from magsim.benchmark.metrics import BY_NAME, scores_of
from magsim.benchmark.residuals import Judged, Residuals, pooled
from magsim.benchmark.twins import PEAKS_NT, Twin, twin_of
from magsim.ladder.baselines import BASELINES
from magsim.ladder.definition import Level, read_ladder
from magsim.ladder.flights import LevelFlights, fly_set
from magsim.ladder.results import WHOLE, Entered, Score
from magsim.ladder.tracks import TRACKS, LadderTrack, blind_of, judged_flights, training_of
from magsim.recording import Recording
from magsim.streams import stream
from magsim.threads import one_blas_thread

CROP_S = LONGEST_WARMUP_S
"""Time at the start of each flight that counts for nobody [s]."""

PARTS = ("std_nt", "ir")
"""Metrics that are kept of single flights and their parts too."""

Report = Callable[[str], None]


@dataclass(frozen=True)
class SetTask:
    """What is judged on one set.

    Attributes
    ----------
    number, seed : int
    levels, tracks : tuple of str
    entries : tuple of Contestant
    networks : tuple of Contestant
        Methods that are judged on some levels alone.
    network_levels : tuple of str
    limits : Allowance
    """

    number: int
    seed: int
    levels: tuple[str, ...]
    tracks: tuple[str, ...]
    entries: tuple[Contestant, ...]
    networks: tuple[Contestant, ...]
    network_levels: tuple[str, ...]
    limits: Allowance


@dataclass(frozen=True)
class SetResult:
    """What came of it: scores, what became of each method, and the raw error of each flight by a path of names [nT]."""

    number: int
    scores: tuple[Score, ...]
    entered: tuple[Entered, ...]
    errors: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class _Test:
    """A flight that is judged, its twin, and in which round the original comes."""

    role: str
    recording: Recording
    twin: Twin
    first: bool


@dataclass(frozen=True)
class _Case:
    """One level, track and magnetometer of a set."""

    task: SetTask
    level: Level
    track: LadderTrack
    sensor: str
    training: tuple[Recording, ...]
    tests: tuple[_Test, ...]

    def rng(self, purpose: str) -> np.random.Generator:
        """Return the generator of one purpose: the same whatever else is judged."""
        case = f"{self.task.number}/{self.level.name}/{self.track.name}/{self.sensor}"
        return stream(self.task.seed, f"ladder/{purpose}/{case}")


@lru_cache(maxsize=1)
def _contest() -> Contest:
    """Return the server of this process, which starts methods in processes of their own."""
    return Contest()


def judge_set(task: SetTask, report: Report = lambda _line: None) -> SetResult:
    """Fly a set and judge every method on it.

    The truth is in the memory of this process alone.
    """
    ladder = read_ladder()
    levels, tracks = ladder.chosen(task.levels), [TRACKS[name] for name in task.tracks]
    scores: list[Score] = []
    entered: list[Entered] = []
    errors: dict[str, np.ndarray] = {}
    with one_blas_thread():
        later = any(track.later for track in tracks)
        flown = fly_set(ladder, levels, task.seed, task.number, later=later, report=report)
        for case in _cases(task, levels, tracks, flown):
            for entry, outcome, found in _judged(case, report):
                entered += [] if outcome is None else [_entered(case, entry, outcome)]
                scores += _scores(case, entry.name, found)
                path = f"{case.level.name}/{case.track.name}/{case.sensor}/{entry.name}"
                errors |= {f"{path}/{role}": values for role, (_, values) in found.items()}
    return SetResult(task.number, tuple(scores), tuple(entered), errors)


def _cases(
    task: SetTask, levels: Sequence[Level], tracks: Sequence[LadderTrack], flown: Mapping[str, LevelFlights]
) -> Iterator[_Case]:
    for level in levels:
        for sensor in level.sensors:
            for track in tracks:
                training = training_of(track, flown[level.name], sensor)
                if training is None:
                    continue
                case = _Case(task, level, track, sensor, training, ())
                yield _Case(task, level, track, sensor, training, tuple(_tests(case, flown[level.name])))


def _tests(case: _Case, flights: LevelFlights) -> Iterator[_Test]:
    """Yield the flights with their twins; each set gives each flight another height of anomaly, or none."""
    rng = case.rng("twins")
    heights = (*PEAKS_NT, 0.0)
    for number, (role, recording) in enumerate(judged_flights(case.track, flights).items()):
        height = heights[(number + case.task.number) % len(heights)]
        yield _Test(role, recording, twin_of(recording, case.sensor, rng, height), bool(rng.integers(2)))


Found = Mapping[str, tuple[Residuals, np.ndarray]]
"""Residuals of a method, and its raw error over the whole flight [nT], by role."""


def _judged(case: _Case, report: Report) -> Iterator[tuple[Contestant, Finish | None, Found]]:
    for name, baseline in BASELINES.items():
        pairs = [
            (baseline(one.recording, case.sensor), baseline(one.twin.recording, case.sensor)) for one in case.tests
        ]
        yield Contestant(name, name), None, _residuals(case, name, pairs)
    rounds: list[list[Recording]] = [[], []]
    for one in case.tests:
        both = [blind_of(case.track, recording, case.sensor) for recording in (one.recording, one.twin.recording)]
        for number, recording in enumerate(both if one.first else both[::-1]):
            rounds[number].append(recording)
    for entry in _entries(case):
        report(f"{entry.name} on {case.level.name}, {case.track.name}")
        outcome = _contest().run(
            entry, case.training, case.sensor, rounds, case.task.limits, case.rng(f"contest/{entry.name}")
        )
        if outcome.status != "ok":
            yield entry, outcome, {}
            continue
        found = [(a, b) if one.first else (b, a) for one, a, b in zip(case.tests, *outcome.estimates, strict=True)]
        yield entry, outcome, _residuals(case, entry.name, found)


def _entries(case: _Case) -> tuple[Contestant, ...]:
    networks = case.task.networks if case.level.name in case.task.network_levels else ()
    return (*case.task.entries, *networks)


def _residuals(case: _Case, name: str, estimates: Sequence[tuple[np.ndarray, np.ndarray]]) -> Found:
    out = {}
    for one, (estimate, twin_estimate) in zip(case.tests, estimates, strict=True):
        judged = Judged(one.role, "", case.sensor, None, case.task.seed, name)
        residuals = residuals_of(
            one.recording,
            sensor=case.sensor,
            estimate=estimate,
            twin=one.twin,
            twin_estimate=twin_estimate,
            judged=judged,
            crop_s=CROP_S,
        )
        reading, clean = one.recording[f"mag_{case.sensor}_nt"], one.recording[f"clean_{case.sensor}_nt"]
        out[one.role] = residuals, (reading - clean - estimate).astype(np.float32)
    return out


def _scores(case: _Case, method: str, found: Found) -> Iterator[Score]:
    """Yield the scores of all flights together, and the main ones of each flight and its parts."""

    def score(flight: str, segment: str, metric: str, value: float) -> Score:
        return Score(
            case.track.name, case.level.name, case.task.number, case.sensor, method, flight, segment, metric, value
        )

    if not found:
        return
    whole = pooled([residuals for residuals, _ in found.values()])
    for metric in BY_NAME.values():
        value = metric.of(whole) if "test" in metric.scopes else None
        if value is not None:
            yield score(WHOLE, "test", metric.name, value)
    for role, (residuals, _) in found.items():
        for segment, metric_name, value in scores_of(residuals):
            if metric_name in PARTS or (metric_name == "fom_nt" and segment == "test"):
                yield score(role, segment, metric_name, value)


def _entered(case: _Case, entry: Contestant, outcome: Finish) -> Entered:
    costs = outcome.costs
    return Entered(
        case.track.name,
        case.level.name,
        case.task.number,
        case.sensor,
        entry.name,
        outcome.status,
        outcome.reason,
        outcome.adapts,
        outcome.pretrained,
        outcome.requires,
        outcome.learned,
        costs.fit_cpu_s,
        costs.fit_wall_s,
        costs.estimate_us,
        costs.peak_mb,
        costs.state_bytes,
        costs.parameters,
    )
