"""Fit methods on training rows, judge them on test rows, and report: group by group."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

from magsim import __version__, columns, signals
from magsim.benchmark.judging import LONGEST_WARMUP_S, NOISE_FLOOR, judge
from magsim.benchmark.methods import Method, NamedMethod, named_methods
from magsim.benchmark.report import Report, rows_of
from magsim.benchmark.rows import Fit, Row
from magsim.compensation import FitContext
from magsim.dataset import Data, FlightInfo, Group, Training, groups_of, pick_sensor, pieces_to_judge, read_training
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

T = TypeVar("T")


def evaluate(
    data: Data,
    methods: Method | Sequence[Method],
    *,
    sensor: str | None = None,
    seed: int = 0,
    quick: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Fit methods on the training rows and judge them on the test rows.

    What belongs together is fitted together: see ``magsim.dataset.groups_of``.

    Parameters
    ----------
    data : Recording, Dataset, Path, str, or several of them
        Recordings with the segment column ``split``.
    methods : sequence
        Names of methods, with settings if need be (``name:key=value``), ``noise_floor`` among them; ``all``, for every
        name that is known; compensators, of which a copy is fitted if they are not yet; or pairs of a name for the
        table and a compensator. Of ``all``, methods that the recordings do not suffice for are left out, with a note.
    sensor : str, optional
        The scalar magnetometer; by default that of a fitted compensator, else the first of the first recording.
    seed : int
        Seed of the fits.
    quick : bool
        Take the preset ``quick`` of methods by name that have one, unless another preset is named.
    progress : callable, optional
        Called with one line of text for each step.

    Returns
    -------
    Report

    Raises
    ------
    RequestError
        If a method, the sensor, a column, the training rows or the test rows are missing, or a method declares a
        warm-up of more than 60 s.
    DataError
        If a part is too short to be filtered, or an estimate is not what it must be.
    """
    named, left_out = named_methods(methods, quick=quick)
    FitContext(seed)  # refuses what is no seed before anything is read
    groups = groups_of(data)
    if not groups:
        msg = "nothing to benchmark: no recording was given"
        raise RequestError(msg)
    work = _Evaluation(named, _fitted_sensor(named, sensor), seed, progress or (lambda line: None))
    work.notes += left_out
    for group in groups:
        work.run(group)
    return work.report()


def _fitted_sensor(named: Sequence[NamedMethod], sensor: str | None) -> str | None:
    """Return the named sensor, else that of a fitted method; all fitted methods must be for it."""
    fitted = {one.compensator.sensor_: one for one in named if one.compensator is not None and one.given}
    sensor = sensor or next(iter(fitted), None)
    other = next((name for name in fitted if name != sensor), None)
    if other is not None:
        msg = f"method {fitted[other].name} was trained for the sensor {other!r}, not {sensor!r}"
        raise RequestError(msg)
    return sensor


def _warmup_s(methods: Sequence[NamedMethod]) -> float:
    """Return the longest warm-up of all methods [s]: all are judged on the same rows."""
    return max([0.0, *(one.compensator.warmup_s for one in methods if one.compensator is not None)])


def _check_warmup(one: NamedMethod) -> None:
    """Refuse a method whose warm-up would take too many rows from all others."""
    warmup_s = 0.0 if one.compensator is None else one.compensator.warmup_s
    if not 0.0 <= warmup_s <= LONGEST_WARMUP_S:
        msg = f"method {one.name} declares a warm-up of {warmup_s:g} s; allowed: 0 to {LONGEST_WARMUP_S:g} s"
        raise RequestError(msg)


def _own_copy(training: Training) -> Training:
    """Return training rows for one method: what it does to them does not reach the next.

    Columns are shared, since nothing can write to them.
    """
    recordings = tuple(replace(recording) for recording in training.recordings)
    return replace(training, recordings=recordings, valid=tuple(mask.copy() for mask in training.valid))


class _Evaluation:
    """The work of ``evaluate``, group by group, and what it has found so far."""

    def __init__(
        self, named: Sequence[NamedMethod], sensor: str | None, seed: int, progress: Callable[[str], None]
    ) -> None:
        self.named, self.sensor, self.seed, self.progress = tuple(named), sensor, seed, progress
        self.rows: list[Row] = []
        self.fits = [Fit(one.name, "", (), 0, 0, given=True) for one in self.named if one.given]
        self.notes: list[str] = []
        self.fit_s: dict[tuple[str, str], float] = {}
        self.judged: list[dict[str, object]] = []
        self.groups: dict[str, list[str]] = {}
        self.untested: list[str] = []
        self.warmup_s = _warmup_s(named)

    def run(self, group: Group) -> None:
        """Fit and judge one group, with no more than one of its flights in memory beside its training rows."""
        sensor = self.sensor or pick_sensor([group.flights[0].read()])
        # before the fits, which may take long
        tests = [info for info in group.flights if self._has_test_rows(info, sensor)]
        if not tests:
            return
        self.groups[group.name] = [info.name for info in group.flights]
        given = all(one.compensator is None or one.given for one in self.named)
        training = None if given else read_training(group.flights, sensor)
        tried = [self._try(one, "", partial(self._fit, one, group, training)) for one in self.named]
        fitted = [one for one in tried if one is not None]
        self.warmup_s = _warmup_s(fitted)
        for info in tests:
            self._judge(fitted, info, info.read(), sensor)

    def _try(self, one: NamedMethod, where: str, work: Callable[[], T]) -> T | None:
        """Return what a piece of work on a method gives; None, with a note, where one of ``all`` is not up to it."""
        try:
            return work()
        except (RequestError, DataError) as error:
            if not one.optional:
                raise
            note = f"method {one.name} is left out{where}: {error}"
            # every group says the same of a method that none suffices for
            self.notes += [] if note in self.notes else [note]
            return None

    def _has_test_rows(self, info: FlightInfo, sensor: str) -> bool:
        """Whether a flight has rows to be judged; note those that a dropout takes."""
        if info.splits and "test" not in info.splits:
            self.untested.append(f"{info.name!r} has split = test")
            return False
        recording = info.read()
        found = bool(pieces_to_judge(recording, sensor))
        test = recording.mask(split="test")
        silent = test & ~recording.reads(sensor)
        if silent.any():
            self.notes.append(
                f"recording {recording.name!r}: {silent.sum()} test rows in which {sensor!r} does not read are left "
                f"out, and {signals.EDGE_S:g} s on both sides of each dropout"
            )
        if not found:
            reading = f" and a reading of {sensor!r}" if test.any() else ""
            self.untested.append(f"{recording.name!r} has split = test{reading}")
        return found

    def _fit(self, one: NamedMethod, group: Group, training: Training | None) -> NamedMethod:
        """Return a fitted method: as it came, or a copy that is fitted on the group's training rows."""
        _check_warmup(one)
        if one.compensator is None or one.given or training is None:
            return one
        names = tuple(dict.fromkeys(recording.name for recording in training.recordings))
        self.progress(f"fitting {one.name}")
        started = time.process_time()
        fitted = one.compensator.unfitted().fit_rows(_own_copy(training), FitContext(self.seed))
        self.fit_s[one.name, group.name] = time.process_time() - started
        self.fits.append(Fit(one.name, group.name, names, **training.rows, given=False))
        made = replace(one, compensator=fitted)
        _check_warmup(made)  # that of a network follows from the rate of the rows
        return made

    def _judge(self, fitted: Sequence[NamedMethod], info: FlightInfo, recording: Recording, sensor: str) -> None:
        """Score every method on one recording."""
        name = recording.name
        truth = columns.CLEAN.name(sensor=sensor) in recording
        if not truth:
            self.notes.append(f"recording {name!r} has no truth: only the papers' scores, of the reading itself")
        found = []
        for one in fitted:
            if one.compensator is None and (not truth or columns.INTERFERENCE.name(sensor=sensor) not in recording):
                self.notes.append(f"recording {name!r} has no label and truth for the row {NOISE_FLOOR}")
                continue
            self.progress(f"{one.name} on {name}")
            judged = partial(
                judge,
                one.compensator,
                recording,
                sensor=sensor,
                name=one.name,
                warmup_s=self.warmup_s,
                file=info.file_name,
                level=info.level,
                seed=self.seed,
            )
            residuals = self._try(one, f" of {name!r}", judged)
            found += [] if residuals is None else rows_of(residuals)
        count = sum(int(piece.judged.sum()) for piece in pieces_to_judge(recording, sensor))
        self.judged.append({"recording": name, "file": info.file_name, "rows": count, "truth": truth})
        if not any(row.metric == "ir_003" for row in found):
            self.notes.append(
                f"recording {name!r} has no ir_003: no test piece is longer than the "
                f"{2.0 * signals.HIGH_PASS_EDGE_S:g} s that the high-pass needs"
            )
        self.rows += found

    def report(self) -> Report:
        """Return what was found.

        Raises
        ------
        RequestError
            If no recording had test rows.
        """
        if not self.rows:
            more = f", and {len(self.untested) - 12} more" if len(self.untested) > 12 else ""
            msg = f"no test rows: no row of {', '.join(self.untested[:12])}{more}"
            raise RequestError(msg)
        compensators = [(one.name, one.compensator) for one in self.named if one.compensator is not None]
        about = {
            "magsim": __version__,
            "seed": self.seed,
            "band_hz": list(signals.BAND_HZ),
            "edge_s": signals.EDGE_S,
            "high_pass_hz": signals.HIGH_PASS_HZ,
            "high_pass_edge_s": signals.HIGH_PASS_EDGE_S,
            "warmup_s": self.warmup_s,
            "methods": {name: {"method": c.name, "params": c.get_params()} for name, c in compensators},
            "recordings": self.judged,
            "groups": self.groups,
        }
        return Report(tuple(self.rows), tuple(self.fits), about, tuple(self.notes), self.fit_s)
