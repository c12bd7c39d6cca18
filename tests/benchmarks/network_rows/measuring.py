"""Fit a method to a flight, judge it and its first stage on others: one case at a time, kept in a journal."""

import json
import multiprocessing
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from magsim.compensation import Compensator, FitContext, create, names, presets_of
from magsim.compensation.networks import NetworkCompensator
from magsim.compensation.registry import lookup
from magsim.errors import DataError, RequestError
from magsim.forking import one_thread
from magsim.recording import Recording
from magsim.threads import one_blas_thread
from tests.benchmarks.network_rows.flights import WORLDS, Judged, honest, pair
from tests.benchmarks.network_rows.journal import Journal
from tests.benchmarks.physics_rows.scoring import score
from tests.benchmarks.physics_rows.shown import tell


@dataclass(frozen=True)
class Case:
    """One fit.

    Attributes
    ----------
    method : str
        Name in the registry.
    params : mapping
        Laid over the preset ``default``.
    world : str
        One of ``flights.WORLDS``, or an honest world of ``physics_rows/sets.py``.
    number : int
        Of the pair or set, from 0.
    seed : int
        Of the fit.
    sensor : str
    """

    method: str
    world: str
    number: int
    seed: int = 0
    params: Mapping[str, Any] = field(default_factory=dict)
    sensor: str = "cabin"

    @property
    def key(self) -> str:
        """The case as text that tells it from every other one."""
        return json.dumps(asdict(self), sort_keys=True)

    @property
    def text(self) -> str:
        """The case in words."""
        settings = "".join(f", {key} {value}" for key, value in self.params.items())
        return f"{self.method}{settings}: world {self.world}, {self.number + 1}, seed {self.seed}"


class Found(NamedTuple):
    """What a method and its first stage leave of one flight.

    Attributes
    ----------
    ir, stage_ir : float
        Improvement ratio in band, against truth.
    std_nt, raw_nt, floor_nt : float [nT]
        In band: of the method's error, of the interference, of the magnetometer's noise.
    fit_s : float [s]
        Processor time of the fit.
    """

    ir: float
    stage_ir: float
    std_nt: float
    raw_nt: float
    floor_nt: float
    fit_s: float

    @property
    def over_stage(self) -> float:
        """What the network adds: the improvement ratio over that of its first stage."""
        return self.ir / self.stage_ir


class OverTimeError(Exception):
    """A fit took longer than it may."""


def networks() -> tuple[str, ...]:
    """Return the names of all networks that have a preset ``default``."""
    found = []
    for name in names():
        cls = lookup(name).load()
        if issubclass(cls, NetworkCompensator) and "default" in presets_of(name):
            found.append(name)
    return tuple(found)


def fitted(case: Case, train: Recording, limit_s: float | None = None) -> tuple[Compensator, float]:
    """Fit the method of a case; return it, and the processor time of the fit [s].

    Raises
    ------
    OverTimeError
        If the fit takes more than ``limit_s`` of processor time; it is asked whenever training tells how far it is.
    """
    began = time.process_time()

    def watch(_: object) -> None:
        if limit_s is not None and time.process_time() - began > limit_s:
            raise OverTimeError

    # lists of a journal are tuples of settings
    params = {key: tuple(value) if isinstance(value, list) else value for key, value in case.params.items()}
    method = create(case.method, preset="default", **params)
    method.fit(train, sensor=case.sensor, context=FitContext(case.seed, progress=watch))
    return method, time.process_time() - began


def judged(method: Compensator, tests: Mapping[str, Recording], fit_s: float) -> dict[str, Found]:
    """Score a method, and the first stage of a network, on flights by name; both on the same rows."""
    out = {}
    for name, recording in tests.items():
        own = score(method, recording)
        stage = own if not isinstance(method, NetworkCompensator) else _stage_score(method, recording)
        out[name] = Found(own.ir, stage.ir, own.std_nt, own.raw_nt, own.floor_nt, fit_s)
    return out


def _stage_score(method: NetworkCompensator, recording: Recording) -> Any:
    return score(method._fitted.stage, recording, warmup_s=method.warmup_s)


def read(folder: Path, case: Case) -> Judged:
    """Return the flights of a case."""
    return pair(folder, case.world, case.number) if case.world in WORLDS else honest(folder, case.world, case.number)


def measure(folder: Path, case: Case, limit_s: float | None = None) -> dict[str, Any]:
    """Fit and judge one case on one thread.

    Returns
    -------
    dict
        ``{"tests": {name: Found as a dict}}``, or ``{"failed": reason}`` where the fit takes too long, diverges or is
        refused.
    """
    with one_blas_thread():
        flights = read(folder, case)
        try:
            method, fit_s = fitted(case, flights.train, limit_s)
        except OverTimeError:
            return {"failed": f"more than {limit_s:g} s", "limit_s": limit_s}
        except (DataError, RequestError) as error:
            return {"failed": str(error)}
        return {"tests": {name: one._asdict() for name, one in judged(method, flights.tests, fit_s).items()}}


def measured(
    cases: Iterable[Case],
    folder: Path,
    journal: Journal,
    *,
    workers: int = 1,
    until: float | None = None,
    limit_s: float | None = None,
) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Measure what the journal lacks; yield all cases with their results, in the order in which they are known.

    Parameters
    ----------
    cases, folder, journal
    workers : int
        Processes beside this one; with 1 there are none.
    until : float, optional
        Instant of ``time.monotonic`` after which no case begins.
    limit_s : float, optional
        See ``fitted``.
    """
    missing: dict[str, Case] = {}
    seen = set()
    for case in cases:
        found = journal.get(asdict(case))
        if found is None or _may_last(found, limit_s):
            missing[case.key] = case
        elif case.key not in seen:
            seen.add(case.key)
            yield case, found
    asked = [*missing.values()]
    work = partial(measure, folder, limit_s=limit_s)
    results = _here(asked, work, until) if workers == 1 else _apart(asked, work, until, workers)
    for done, (case, found) in enumerate(results, 1):
        journal.add(asdict(case), found)
        tell(f"{done} of {len(asked)}: {case.text}: {told(found)}")
        yield case, found


def _may_last(found: Mapping[str, Any], limit_s: float | None) -> bool:
    """Whether a fit was broken off that now may last longer."""
    return "limit_s" in found and (limit_s is None or limit_s > found["limit_s"])


def told(found: Mapping[str, Any]) -> str:
    """Return a result in words."""
    if "failed" in found:
        return f"failed: {found['failed']}"
    each = {name: Found(**one) for name, one in found["tests"].items()}
    scores = "; ".join(f"{name} {one.ir:.4g} ({one.over_stage:.3g} times its stage)" for name, one in each.items())
    return f"{scores}; fit {next(iter(each.values())).fit_s:.1f} s"


Work = Callable[[Case], dict[str, Any]]


def _is_over(until: float | None) -> bool:
    return until is not None and time.monotonic() > until


def _here(cases: Sequence[Case], work: Work, until: float | None) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Work in this process."""
    for case in cases:
        if _is_over(until):
            return
        yield case, work(case)


def _apart(
    cases: Sequence[Case], work: Work, until: float | None, workers: int
) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Work in processes of their own."""
    waiting = deque(cases)
    running: dict[Future[dict[str, Any]], Case] = {}
    with one_thread(), ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        while running or (waiting and not _is_over(until)):
            while waiting and len(running) < workers and not _is_over(until):
                case = waiting.popleft()
                running[pool.submit(work, case)] = case
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(done), done.result()
