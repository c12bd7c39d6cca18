"""The pieces of work of paper 000: trainings, closed forms, and what an output costs."""

import math
import time
from collections.abc import Sequence, Set
from itertools import product
from typing import Any

import numpy as np

from magsim.benchmark import NOISE_FLOOR, judge, scores_of
from magsim.compensation import Compensator, FitContext, create
from magsim.compensation.networks import NetworkCompensator
from magsim.dataset import Training
from magsim.dataset.rows import training_rows
from magsim.papers.paper import Effort, Found, Surroundings, Task
from magsim.papers.paper_000 import worlds
from magsim.papers.paper_000.clean import CleanField
from magsim.papers.paper_000.published import EPOCHS, NETWORKS
from magsim.papers.paper_000.recipes import TrainingRecipe, by_recipe, recipe_of, settings_of
from magsim.papers.rows import TRAIN, split_as
from magsim.recording import Recording

CLOSED = ("none", "tl16", "tl16_auxiliary", "exact_norm", NOISE_FLOOR)
"""Methods that are not trained in steps."""

DRAWN = ("none", "tl16")
"""Those of them that stand beside the networks in the paper's figures, of the first flight and the first lines."""

DECIMALS = 4
"""Of curves [nT]."""

SCORES = ("std_nt", "ir", "rmse0_nt", "gain", "std_paper_nt", "ir_paper")

WARMUP_S = 31.9
"""Of the networks with windows of 320 rows; all methods are judged on the same rows."""

LEAD_ROWS = 640
"""Rows before those that are judged: warm-up, and what the band-pass spoils."""


def tasks(effort: Effort) -> list[Task]:
    """Return all work: on the simulated flights, on the lines, and the cost of an output."""
    flights = [(name,) for name in worlds.simulated(effort)]
    few = flights[: max(1, len(flights) // 3)]
    lines = worlds.lines(effort)
    limit_s = 0.2 if effort.quick else 30.0
    drawn = {flights[0], lines[0]}
    out = [_closed(method, names, worlds.SIMULATED, drawn) for method, names in product(CLOSED, flights)]
    out += [_closed(method, names, worlds.LINES, drawn) for method, names in product(CLOSED, lines)]
    out += [Task("cost", flights[0], {"network": network, "limit_s": limit_s}) for network in NETWORKS]
    out += [_default(network, names, effort) for network, names in product(NETWORKS, flights)]
    for network in NETWORKS:
        out += [_recipe(network, names, worlds.SIMULATED, effort, drawn) for names in flights]
        out += [_recipe(network, names, worlds.SIMULATED, effort, output="clean field") for names in few]
        out += [_recipe(network, names, worlds.LINES, effort, drawn) for names in lines]
    return out


def _closed(method: str, flights: tuple[str, ...], world: str, drawn: Set[tuple[str, ...]]) -> Task:
    curve = {"curve": True} if flights in drawn and method in DRAWN else {}
    return Task("judge", flights, {"method": method, "world": world, **curve})


def _default(network: str, flights: tuple[str, ...], effort: Effort) -> Task:
    preset = "quick" if effort.quick else "default"
    return Task("judge", flights, {"method": network, "preset": preset, "world": worlds.SIMULATED}, seed=1)


def _recipe(
    network: str,
    flights: tuple[str, ...],
    world: str,
    effort: Effort,
    drawn: Set[tuple[str, ...]] = frozenset(),
    *,
    output: str = "interference",
) -> Task:
    recipe = recipe_of(network, effort)
    params = {
        "network": network,
        "world": world,
        "output": output,
        "batch": recipe.batch,
        "steps": recipe.steps,
        "validations": recipe.validations,
        "small": effort.quick,
        **({"curve": True} if flights in drawn else {}),
    }
    return Task("train", flights, params, seed=1)


def work(task: Task, recordings: Sequence[Recording], surroundings: Surroundings) -> Found:
    """Do one piece of work."""
    if task.work == "cost":
        return cost(task.params["network"], recordings[0], task.params["limit_s"], surroundings.device)
    context = FitContext(task.seed, checkpoint=surroundings.folder)
    parts = worlds.JUDGED[task.params["world"]]
    if task.work == "judge":
        name = task.params["method"]
        method = None if name == NOISE_FLOOR else create(name, preset=task.params.get("preset"))
        if method is not None:
            method.fit_rows(training_rows(recordings), context)
        return _scores(method, recordings, parts, curve=bool(task.params.get("curve")))
    context = FitContext(task.seed, checkpoint=surroundings.folder, device=surroundings.device)
    training = training_rows(_learned(recordings))
    recipe = TrainingRecipe(task.params["batch"], task.params["steps"], task.params["validations"])
    channels = task.params["world"] == worlds.LINES
    settings = settings_of(task.params["network"], recipe, training, small=task.params["small"], channels=channels)
    trained = by_recipe(task.params["network"], settings, clean=task.params["output"] == "clean field")
    trained.fit_rows(training, context)
    return {**_scores(trained, recordings, parts, curve=bool(task.params.get("curve"))), **_losses(trained)}


def _learned(recordings: Sequence[Recording]) -> list[Recording]:
    """Return all rows that are learned, as in the paper, and once more those of leg 4, which choose the epoch.

    A leg that is not learned is a heading that is not learned: networks without Tolles-Lawson first fail on it.
    Legs by themselves let a network be judged on the way at a fraction of the cost.
    """
    out = []
    for recording in recordings:
        valid = recording.mask(split="valid")
        learned = recording.mask(split="train") | valid
        if learned.any():
            out += [split_as(recording.take(learned), TRAIN), recording.take(valid)]
    return out


def _judged(recording: Recording) -> Recording | None:
    """Return the test rows and what is flown just before them; None where there are none."""
    test = np.flatnonzero(recording.mask(split="test"))
    if not len(test):
        return None
    rows = np.zeros(len(recording), dtype=bool)
    rows[max(0, test[0] - LEAD_ROWS) :] = True
    return recording.take(rows)


def _scores(
    method: Compensator | None, recordings: Sequence[Recording], parts: Sequence[str], *, curve: bool = False
) -> dict[str, Any]:
    """Judge a method on each part, every method on the same rows; return what it leaves too, for a picture."""
    judged = [one for one in map(_judged, recordings) if one is not None]
    found: dict[str, Any] = {}
    for part, recording in zip(parts, judged, strict=True):
        residuals = judge(method, recording, warmup_s=WARMUP_S)
        of_all = {metric: value for segment, metric, value in scores_of(residuals) if segment == "test"}
        found |= {f"{score} {part}": of_all[score] for score in SCORES}
        if curve:
            assert residuals.error is not None
            left = np.round(residuals.error, DECIMALS).tolist()
            found[f"curve {part}"] = {
                "time_s": (residuals.time_s - residuals.time_s[0]).round(1).tolist(),
                "left": left,
            }
    return found


def _losses(trained: Compensator) -> dict[str, object]:
    """Return the training loss by epoch [nT^2], and after how many of them the network was best.

    That of epoch 0 is of the network before the first step, whose output is the mean.
    """
    network = trained.network_ if isinstance(trained, CleanField) else trained
    assert isinstance(network, NetworkCompensator)
    (outcome,) = network.outcomes_.values()
    square = float(network.state().values["scale_nt"]) ** 2
    steps = [step for step, _, _ in outcome.history]
    losses = [square if math.isnan(loss) else square * loss for _, loss, _ in outcome.history]
    epochs = [EPOCHS[-1] * step / steps[-1] for step in steps]
    return {"epochs": epochs, "losses": losses, "best epoch": EPOCHS[-1] * outcome.best_step / steps[-1]}


def cost(network: str, recording: Recording, limit_s: float, device: str) -> Found:
    """Return the operations of an output, and its time at batch 1, the mean of as many as the paper's or the limit.

    The network has the paper's size and its start weights; operations are multiply-accumulates.
    """
    import torch

    from magsim.compensation.networks.counting import multiply_accumulates, parameters
    from magsim.compensation.networks.inputs import fit_inputs

    method = create(network, preset="paper")
    assert isinstance(method, NetworkCompensator)
    training: Training = training_rows([recording])
    columns = fit_inputs(method.settings, training)(training.recordings[0])
    module = method.make_module(columns.names).to(device).eval()
    window = method.settings.window
    given = torch.from_numpy(np.ascontiguousarray(columns.matrix[:window].T[None], dtype=np.float32)).to(device)
    count = 0
    with torch.no_grad():
        for _ in range(3):
            module(given)
        started = time.perf_counter()
        while count < 30_000 and (count == 0 or time.perf_counter() - started < limit_s):
            module(given).cpu()  # waits for the device
            count += 1
        spent_s = time.perf_counter() - started
    operations = multiply_accumulates(module, len(columns.names), window)
    return {
        "ms": 1e3 * spent_s / count,
        "million": operations / 1e6,
        "parameters": parameters(module),
        "outputs": count,
    }
