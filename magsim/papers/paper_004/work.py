"""Flights of paper 004 and what is done with them: each method learns circuit 1 and is judged on circuit 2."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.benchmark import judge
from magsim.benchmark.formulas import std
from magsim.benchmark.metrics import BY_NAME
from magsim.compensation import Compensator, FitContext
from magsim.compensation.networks import SubnetworksCompensator
from magsim.compensation.registry import create
from magsim.compensation.targets.model import model_strength
from magsim.papers.paper import Effort, Found, PaperFlight, Surroundings, Task
from magsim.papers.paper_004.published import TABLE_6
from magsim.recording import Recording

FIELD_NETS = ("Z1", "Z2", "Z6")
"""Of the Earth's field: time, position, and their changes."""


class Chosen(NamedTuple):
    """How a method is made."""

    name: str
    preset: str | None = None
    settings: Mapping[str, object] = {}


METHODS: Mapping[str, Chosen | None] = {
    "least_squares": Chosen("tl16_measured", settings={"solver": "least_squares"}),
    "aircraft": Chosen("subnetworks", "paper", {"inputs": ("tl16",)}),
    "all_nets": Chosen("subnetworks", "paper"),
    "least_squares_broad": Chosen("tl16", settings={"solver": "least_squares", "band": "broad"}),
    "default": Chosen("subnetworks", "default"),
    "tl16_auxiliary": Chosen("tl16_auxiliary"),
    "exact_norm": Chosen("exact_norm"),
    "noise_floor": None,
}
"""The paper's three first; None is the label itself."""


def flights(effort: Effort) -> list[PaperFlight]:
    """Return flights of each experiment: other gusts, noise and days of the field in each."""
    return [
        PaperFlight(f"{code.lower()}_{number:02d}", f"papers/004_{code.lower()}", (f"seed={1000 + number}",))
        for code in TABLE_6
        for number in range(effort.count(8, 1))
    ]


def tasks(effort: Effort) -> list[Task]:
    """Return the fit of each method to each flight."""
    out = []
    for number in range(effort.count(8, 1)):
        for code in TABLE_6:
            for name, method in METHODS.items():
                preset = None if method is None else method.preset
                quick = effort.quick and preset is not None
                params = {
                    "experiment": code,
                    "method": name,
                    "preset": "quick" if quick and preset == "default" else preset,
                    "steps": 5 if quick and preset == "paper" else 0,
                }
                out.append(Task("judge", (f"{code.lower()}_{number:02d}",), params, seed=number))
    return out


def work(task: Task, recordings: Sequence[Recording], surroundings: Surroundings) -> Found:
    """Fit one method to circuit 1 and judge it on both."""
    recording = without_model(recordings[0])
    method = METHODS[task.params["method"]]
    if method is None:
        return scores(None, recording)
    steps = {"steps": task.params["steps"]} if task.params["steps"] else {}
    made = create(method.name, preset=task.params["preset"], **{**method.settings, **steps})
    context = FitContext(task.seed, checkpoint=surroundings.folder) if made.trains else FitContext(task.seed)
    made.fit(recording, context=context)
    return scores(made, recording)


def without_model(recording: Recording) -> Recording:
    """Return the recording with the change of the model field along the flight taken off reading and clean field.

    Along three kilometers it is larger than what the paper's methods leave, so the paper's data cannot hold it.
    """
    (sensor,) = recording.scalars
    model = model_strength(recording)
    names = columns.MAG.name(sensor=sensor), columns.CLEAN.name(sensor=sensor)
    changed = {name: recording[name] - (model - model.mean()) for name in names}
    return replace(recording, data={**recording.data, **changed})


def scores(made: Compensator | None, recording: Recording) -> dict[str, float]:
    """Return what a method leaves [nT], STD broadband: of the reading, of the interference; its IR in band.

    ``left`` is the paper's: where a method has nets of the field, what these explain is taken off too.
    """
    (sensor,) = recording.scalars
    residuals = judge(made, recording, sensor=sensor, twins=False)
    ratio = BY_NAME["ir"].of(residuals)
    assert ratio is not None
    reading, clean = (recording[family.name(sensor=sensor)] for family in (columns.MAG, columns.CLEAN))
    estimate = recording[columns.INTERFERENCE.name(sensor=sensor)] if made is None else made.interference(recording)
    nets = made.parts(recording) if isinstance(made, SubnetworksCompensator) else {}
    field = sum((nets[name] for name in FIELD_NETS if name in nets), np.zeros(len(recording)))
    found = {"ir": float(ratio)}
    for circuit, where in ((1, "learned"), (2, "other")):
        rows = (recording[columns.CIRCUIT.pattern] == circuit) & np.isfinite(estimate)
        signals = {
            "raw": reading,
            "left": reading - estimate - field,
            "left_reading": reading - estimate,
            "error": reading - clean - estimate,
            "field": clean,
            "field_found": field,
            "field_missed": clean - field,
            **nets,
        }
        found |= {f"{name} {where}": std(values[rows]) for name, values in signals.items()}
    return found
