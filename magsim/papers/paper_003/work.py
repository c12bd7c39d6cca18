"""Flights and tasks of paper 003: every method in its worlds, scored on the last fifth of the flight."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from magsim import columns
from magsim.benchmark import judge
from magsim.benchmark.formulas import ratio, rms, std
from magsim.benchmark.metrics import scores_of
from magsim.compensation import Compensator, FitContext, create
from magsim.dataset import training_rows
from magsim.papers.paper import Effort, Found, PaperFlight, Surroundings, Task
from magsim.papers.paper_003 import worlds
from magsim.papers.paper_003.candidates import (
    CANDIDATES,
    DEFAULTS,
    EPOCHS,
    FEW,
    GRID,
    LINEAR,
    PRINTED,
    QUICK_EPOCHS,
    QUICK_STEPS,
    TAPS,
    VARIANTS,
    Candidate,
)
from magsim.papers.paper_003.published import TABLE_1
from magsim.papers.paper_003.worlds import SENSOR
from magsim.recording import Recording
from magsim.signals import EDGE_S

SCENARIO = "papers/003_path"
FULL, QUICK = 6, 2
"""Flights of the full run, and of the quick one."""

DECIMALS = 3
"""Of curves [nT]."""


def flights(effort: Effort) -> list[PaperFlight]:
    """Return the flights: each path without an aircraft's field, and as an ordinary drone."""
    out = []
    for number in range(effort.count(FULL, QUICK)):
        seed = f"seed={1000 + number}"
        out += [
            PaperFlight(f"path_{number:02d}", SCENARIO, (seed, *worlds.NO_AIRCRAFT)),
            PaperFlight(f"drone_{number:02d}", SCENARIO, (seed,)),
        ]
    return out


def tasks(effort: Effort) -> list[Task]:
    """Return all fits, flight by flight; a flight's number is the seed of its coefficients and of its start weights."""
    return [
        _task(number, world, name, effort)
        for number in range(effort.count(FULL, QUICK))
        for world, names in _lines()
        for name in names
    ]


def _lines() -> Iterator[tuple[str, Sequence[str]]]:
    """Yield each world with the methods that are judged in it: Tables 3 and 2, Table 3 of an aircraft, Table 1.

    The networks' defaults have a first stage, which leaves nothing of what is drawn.
    """
    yield "drawn", (*PRINTED, *VARIANTS, *LINEAR, *GRID)
    yield "physical", (*PRINTED, *VARIANTS, *DEFAULTS, *LINEAR)
    for world in ("static", "dynamic"):
        yield world, (*TABLE_1, *FEW)


def _task(number: int, world: str, name: str, effort: Effort) -> Task:
    flight = f"{'drone' if world == 'physical' else 'path'}_{number:02d}"
    params: dict[str, Any] = {"world": world, "line": name}
    if CANDIDATES[name].printed:
        params["epochs"] = QUICK_EPOCHS if effort.quick else EPOCHS
    elif effort.quick and CANDIDATES[name].preset is not None:
        params |= {"preset": "quick", "steps": QUICK_STEPS}
    if number == 0 and world == "drawn" and name in PRINTED:
        params["curve"] = True
    return Task("judge", (flight,), params, seed=number)


def work(task: Task, recordings: Sequence[Recording], surroundings: Surroundings) -> Found:
    """Fit one method in one world and score it on the test rows."""
    (flight,) = recordings
    world = task.params["world"]
    recording = worlds.split_by_time(flight)
    if world != "physical":
        recording = worlds.drawn(recording, task.seed, world)
    method = _fitted(task, recording, surroundings)
    found: dict[str, Any] = scores(method, recording)
    if task.params.get("curve"):
        found["curve"] = _curve(method, recording)
    return found


def _fitted(task: Task, recording: Recording, surroundings: Surroundings) -> Compensator | None:
    """Return the fitted method of a task; None for the noise floor."""
    candidate = CANDIDATES[task.params["line"]]
    if candidate.method == "noise_floor":
        return None
    params = dict(candidate.params)
    if "steps" in task.params:
        params["steps"] = task.params["steps"]
    elif candidate.printed:
        params["steps"] = _steps(candidate, task.params["epochs"], recording)
    method = create(candidate.method, preset=task.params.get("preset", candidate.preset), **params)
    return method.fit(recording, sensor=SENSOR, context=_context(method, task.seed, surroundings))


def _steps(candidate: Candidate, epochs: float, recording: Recording) -> int:
    """Return the optimizer steps of so many passes over the windows of the training rows."""
    batch = create(candidate.method, preset=candidate.preset, **candidate.params).get_params()["batch"]
    return math.ceil(epochs * training_rows([recording], SENSOR).rows["train"] / batch)


def _context(method: Compensator, seed: int, surroundings: Surroundings) -> FitContext:
    checkpoint: Path = surroundings.folder
    if not method.trains:
        return FitContext(seed)
    return FitContext(seed, checkpoint=checkpoint, device=surroundings.device)


def judged_rows(recording: Recording) -> np.ndarray:
    """Return the rows of the one segment that all methods are judged on, (n,) bool.

    The test, without the rows before the first output of the method that needs most.
    """
    rows = recording.mask(split="test")
    rows[np.flatnonzero(rows)[: TAPS - 1]] = False
    return rows


def before_and_after(method: Compensator | None, recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the interference of the test rows, against truth, and what a method leaves of it, (n,) [nT] each."""
    piece = recording.take(recording.mask(split="test"))
    rows = judged_rows(piece)
    label = columns.INTERFERENCE.name(sensor=SENSOR)
    before = piece[columns.MAG.name(sensor=SENSOR)] - piece[columns.CLEAN.name(sensor=SENSOR)]
    estimate = piece[label] if method is None else method.interference(piece)
    return before[rows], (before - estimate)[rows]


def scores(method: Compensator | None, recording: Recording) -> dict[str, float]:
    """Return the paper's scores (its eq. 14 to 16), broadband, and those of the benchmark in 0.1 to 0.6 Hz.

    Both are of the error against truth. In band the rows near the end of the flight are left out, as a filter needs
    them.
    """
    before, after = before_and_after(method, recording)
    pp_before, pp_after = float(np.ptp(before)), float(np.ptp(after))
    found = {
        "pp before": pp_before,
        "pp after": pp_after,
        "std before": std(before),
        "std after": std(after),
        "ir pp": ratio(pp_before, pp_after),
        "rmse": rms(after),
    }
    start = recording.time_s[np.argmax(recording.mask(split="test"))]
    # what was flown before leads the filter in, and no more of it is needed
    near = recording.take(recording.time_s >= start - 2.0 * EDGE_S)
    warmup_s = (TAPS - 1) / recording.rate_hz
    for segment, metric, value in scores_of(judge(method, near, sensor=SENSOR, warmup_s=warmup_s, twins=False)):
        if segment == "test" and metric in {"std_nt", "ir"}:
            found[{"std_nt": "std band", "ir": "ir band"}[metric]] = value
    return found


def _curve(method: Compensator | None, recording: Recording) -> dict[str, list[float]]:
    """Return time, reading, interference and what is left, over the test rows."""
    before, after = before_and_after(method, recording)
    rows = judged_rows(recording)
    found = {
        "time_s": recording.time_s[rows],
        "reading": recording[columns.MAG.name(sensor=SENSOR)][rows],
        "before": before,
        "after": after,
    }
    return {name: [round(float(value), DECIMALS) for value in values] for name, values in found.items()}
