"""Flights of paper 001 and what is done with them: each method learns from one flight and is judged on the other."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from magsim import columns
from magsim.benchmark import judge
from magsim.benchmark.formulas import ratio, std
from magsim.benchmark.metrics import BY_NAME
from magsim.compensation import Compensator, FitContext
from magsim.compensation.registry import create
from magsim.papers.paper import Effort, Found, PaperFlight, Surroundings, Task
from magsim.papers.rows import TEST, TRAIN, VALID, split_as, without_trends
from magsim.recording import Recording

SENSOR = "boom"
HELD_OUT_LEG = 4
"""Held out where a network is to stop by what it has not learned."""


class Method(NamedTuple):
    """How a method is made, and whether it learns without one heading."""

    name: str
    preset: str | None = None
    settings: Mapping[str, object] = {}
    held_out: bool = False


METHODS: Mapping[str, Method | None] = {
    "least_squares": Method("tl18", settings={"solver": "least_squares"}),
    "ridge": Method("tl18", settings={"solver": "ridge"}),
    "bp": Method("bp", "paper"),
    "res_bp": Method("res_bp", "paper"),
    "least_squares_broad": Method("tl18", settings={"solver": "least_squares", "band": "broad"}),
    "ridge_broad": Method("tl18", settings={"solver": "ridge", "band": "broad"}),
    "bp_held_out": Method("bp", "paper", held_out=True),
    "res_bp_held_out": Method("res_bp", "paper", held_out=True),
    "bp_default": Method("bp", "default"),
    "res_bp_default": Method("res_bp", "default"),
    "tl16": Method("tl16"),
    "tl16_auxiliary": Method("tl16_auxiliary"),
    "exact_norm": Method("exact_norm"),
    "noise_floor": None,
}
"""The paper's four first; None is the label itself."""

NETWORKS = ("bp", "res_bp")
CURVE_STEPS = (100, 200, 400, 800, 1600)
"""Steps after which the networks are judged, beside those of their preset."""


def flights(effort: Effort) -> list[PaperFlight]:
    """Return pairs of flights of one drone, A and B, on days of their own; all rows of each may be learned."""
    out = []
    for pair in range(effort.count(12, 2)):
        for flight, seed, day in (("a", 1000 + pair, 2 * pair + 1), ("b", 2000 + pair, 2 * pair + 2)):
            settings = (f"seed={seed}", f"day={day}", "recording.valid_legs=[]")
            out.append(PaperFlight(f"{flight}_{pair:02d}", "papers/001_fom", settings))
    return out


def tasks(effort: Effort) -> list[Task]:
    """Return the fit of each method to each flight; networks also with fewer steps, for their curves."""
    kinds = [*(_kind(name, effort) for name in METHODS), *(_curve(effort))]
    out = []
    for pair in range(effort.count(12, 2)):
        names = f"a_{pair:02d}", f"b_{pair:02d}"
        for judged, order in (("B", names), ("A", names[::-1])):
            out += [Task("judge", order, {"judged": judged, **kind}, seed=pair) for kind in kinds]
    return out


def _kind(name: str, effort: Effort) -> dict[str, Any]:
    """Return what is asked for of a method; 0 steps are those of its preset."""
    method = METHODS[name]
    preset = None if method is None else method.preset
    if effort.quick and preset == "default":
        preset = "quick"
    return {"method": name, "preset": preset, "steps": 200 if effort.quick and preset == "paper" else 0, "curve": False}


def _curve(effort: Effort) -> list[dict[str, Any]]:
    steps = CURVE_STEPS[:1] if effort.quick else CURVE_STEPS
    return [{**_kind(name, effort), "steps": count, "curve": True} for name in NETWORKS for count in steps]


def work(task: Task, recordings: Sequence[Recording], surroundings: Surroundings) -> Found:
    """Fit one method to the first flight and judge it on the second."""
    first, second = recordings
    method = METHODS[task.params["method"]]
    if method is None:
        return scores(None, second)
    steps = {"steps": task.params["steps"]} if task.params["steps"] else {}
    made = create(method.name, preset=task.params["preset"], **{**method.settings, **steps})
    held = method.held_out & (first[columns.LEG.pattern] == HELD_OUT_LEG)
    context = FitContext(seed=task.seed)
    if made.trains:
        context = FitContext(seed=task.seed, checkpoint=surroundings.folder, device=_device(made, surroundings.device))
    made.fit(split_as(first, np.where(held, VALID, TRAIN)), sensor=SENSOR, context=context)
    return {**scores(made, second), "loss": _losses(made)}


def _device(made: Compensator, device: str) -> str:
    """Return where a method trains: Levenberg-Marquardt knows the CPU alone."""
    return "cpu" if made.get_params()["optimizer"] == "lm" else device


def _losses(made: Compensator) -> list[list[float]]:
    """Return steps and mean squared errors while all rows were learned, of the interference over its variance."""
    outcome = getattr(made, "outcomes_", {}).get("all")
    return [] if outcome is None else [[step, loss] for step, loss, _ in outcome.history if step > 0]


def scores(made: Compensator | None, recording: Recording) -> dict[str, float]:
    """Return the scores of a method on all of a flight.

    STD in band and without the trends of the legs, before and after, and their ratios as the paper has it, of the
    reading; STD in band and improvement ratio against truth; R2 of the interference, unfiltered.
    """
    tested = split_as(recording, TEST)
    residuals = judge(made, tested, sensor=SENSOR, twins=False)
    reading = tested[columns.MAG.name(sensor=SENSOR)]
    label = tested[columns.INTERFERENCE.name(sensor=SENSOR)]
    estimate = label if made is None else made.interference(tested)
    legs = [std(without_trends(tested, values)) for values in (reading, reading - estimate)]
    found = {name: BY_NAME[name].of(residuals) for name in ("std_paper_nt", "ir_paper", "std_nt", "ir")}
    return {
        **{name: float(value) for name, value in found.items() if value is not None},
        "before_nt": std(residuals.reading),
        "before_legs_nt": legs[0],
        "after_legs_nt": legs[1],
        "ir_legs": ratio(*legs),
        "r2": determination(label, estimate),
    }


def determination(true: np.ndarray, estimate: np.ndarray) -> float:
    """Return R2 = 1 - sum (y - yhat)^2 / sum (y - mean y)^2, the paper's last equation."""
    return 1.0 - float(np.sum((true - estimate) ** 2) / np.sum((true - true.mean()) ** 2))
