"""Fit a network to what a closed-form first stage leaves: estimate = stage + mean + weight * scale * network(inputs).

The order of training that works: a closed form in float64 first, then the network on the standardized rest. Adam alone
stops at about 1 nT.

The network learns from all folds but one, and is judged on that one, fold by fold. What was not learned tells
after how many steps the in-band error is about least, and how much of the network's output holds
(``magsim.compensation.networks.evidence``). The answer is the mean of the networks of the folds, or a network that then
learns from all rows for that many steps (Goodfellow, Bengio and Courville, Deep Learning, 2016, algorithm 7.2). An
untrained network returns zeros, and step 0 counts: where training never helps, the estimate is that of the first stage.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, replace

import numpy as np
from torch import nn

from magsim.compensation.base import FitContext
from magsim.compensation.networks.descent import Errand, HeldLesson, descend
from magsim.compensation.networks.evidence import Judge, Part, Unit, share_of
from magsim.compensation.networks.fitted import Fitted, check_rates, target_of
from magsim.compensation.networks.folds import Fold, everything, folds_of
from magsim.compensation.networks.inputs import fit_inputs
from magsim.compensation.networks.modules.committee import Committee
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.spooling import LEAST_NT
from magsim.compensation.networks.stage import first_stage, tutor_of
from magsim.compensation.networks.starting import ModuleFactory, checkpoint_of, is_trained, new_module, started_from
from magsim.dataset import Training
from magsim.recording import Recording
from magsim.streams import integer_seed
from magsim.training import Checkpoint, Outcome

TOLERANCE = 1.1
"""How much worse than the best a validation value may be and still count as about as good."""


def fit_network(
    settings: NetworkSettings,
    module_factory: ModuleFactory,
    training: Training,
    context: FitContext,
    *,
    identity: Mapping[str, object] | None = None,
) -> tuple[Fitted, dict[str, Outcome]]:
    """Fit first stage and network.

    Parameters
    ----------
    settings : NetworkSettings
    module_factory : callable
    training : Training
        With ``hold_out="split"`` and no validation rows the last run alone is made.
    context : FitContext
    identity : mapping, optional
        What a checkpoint belongs to beside settings, seed and data: name and parameters of the method.

    Returns
    -------
    Fitted
    dict of str to Outcome
        Result of each run: ``fold 1``, ``fold 2``, ..., ``all``.

    Raises
    ------
    RequestError
        If a window is too short for the loss, or a column or label is missing.
    DataError
        If the recordings are too short, of different rates or not finite, or training diverges.
    """
    prepared = started_from(_prepare(settings, module_factory, training, context), context)
    run = _Run(settings, training, context, prepared, dict(identity or {}))
    outcomes: dict[str, Outcome] = {}
    members: list[nn.Module] = []
    units: list[Unit] = []
    for number, fold in enumerate(folds_of(training, settings.hold_out, settings.folds) if settings.folds else ()):
        phase = f"fold {number + 1}"
        member, outcomes[phase], judge = run(phase, fold, settings.steps)
        members.append(member)
        units += judge.units(member)
    steps = enough_steps(pooled(list(outcomes.values()))) if outcomes else settings.steps
    share = 1.0 if not outcomes else share_of(units) if settings.shrink else float(steps > 0 or is_trained(context))
    if settings.refit or not members:
        member, outcomes["all"], _ = run("all", everything(training), steps if share > 0.0 else 0)
        members = [member]
    module = members[0] if len(members) == 1 else Committee(members)
    return replace(run.fitted, module=module, weight=share), outcomes


def pooled(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the runs of all folds as one: their mean squared errors step by step; one that has stopped stays."""
    steps = sorted({step for outcome in outcomes for step, _, _ in outcome.history})
    curves = [np.array([value for _, _, value in outcome.history]) for outcome in outcomes]
    places = [[step for step, _, _ in outcome.history] for outcome in outcomes]
    squares = [
        np.mean([curve[np.searchsorted(at, step, "right") - 1] ** 2 for curve, at in zip(curves, places, strict=True)])
        for step in steps
    ]
    values = np.sqrt(squares)
    best = int(np.argmin(values))
    history = tuple((step, float("nan"), float(value)) for step, value in zip(steps, values, strict=True))
    return Outcome(steps[best], float(values[best]), steps[-1], history)


def enough_steps(outcome: Outcome) -> int:
    """Return the steps for the last run: the last that did about as well as the best, 0 if none beat the start.

    The curve is flat and noisy near its least value, and a run with more data bears more steps.
    """
    if outcome.best_step == 0:
        return 0
    return max(step for step, _, value in outcome.history if value <= TOLERANCE * outcome.best_value)


def _prepare(
    settings: NetworkSettings, module_factory: ModuleFactory, training: Training, context: FitContext
) -> Fitted:
    """Fit the stage to all rows, find the scales and make the network.

    A stage without a leg would not know its heading, and a network would be judged by how it mends that.
    """
    sensor, rate_hz = training.sensor, check_rates(training.recordings)
    recordings = training.recordings
    # inputs and stage cut dropouts by themselves, as it is right for them
    whole = Training.whole(recordings, sensor)
    columns, stage = fit_inputs(settings, whole), first_stage(settings).fit_rows(whole)
    every = np.concatenate(
        [(target_of(settings, r, sensor) - stage.interference(r))[r.reads(sensor)] for r in recordings]
    )
    mean, scale = float(every.mean()), max(float(every.std()), LEAST_NT)
    designs = [columns(recording) for recording in recordings]
    names = designs[0].names
    standardizer = Standardizer.of([design.matrix for design in designs])
    module = new_module(settings, module_factory, names, context.seed)
    return Fitted(settings, stage, columns, names, standardizer, mean, scale, module, rate_hz)


@dataclass(frozen=True)
class _Run:
    """One training run: settings and surroundings; called with the rows."""

    settings: NetworkSettings
    training: Training
    context: FitContext
    fitted: Fitted
    identity: dict[str, object]

    def __call__(self, phase: str, fold: Fold, steps: int) -> tuple[nn.Module, Outcome, Judge]:
        """Train the network from its start; the best state by the in-band error on the rows that judge."""
        settings, fitted, sensor = self.settings, self.fitted, self.training.sensor
        module, judge = deepcopy(fitted.module), Judge(fitted, [Part.of(fitted, each, sensor) for each in fold.watched])
        if steps == 0:
            # no step helped: the untrained network, which returns zeros, is the answer
            return module, Outcome(0, judge.value(module), 0, ()), judge
        lesson = self._lesson(fold)
        errand = Errand(
            steps,
            judge.value,
            phase,
            integer_seed(self.context.seed, f"compensation/{phase}/batches"),
            self.context.progress,
            self._checkpoint(phase, steps, lesson),
            self.context.machine,
        )
        return module, descend(settings, module, lesson, errand), judge

    def _lesson(self, fold: Fold) -> HeldLesson:
        fitted, sensor = self.fitted, self.training.sensor
        known = [rows & r.reads(sensor) for r, rows in zip(self.training.recordings, fold.learned, strict=True)]
        pairs = [pair for pair in zip(self.training.recordings, known, strict=True) if pair[1].any()]
        recordings, learned = [recording for recording, _ in pairs], [rows for _, rows in pairs]
        inputs = [fitted.inputs(recording) for recording in recordings]
        rest = [fitted.rest(recording, sensor) / fitted.scale for recording in recordings]
        return HeldLesson(recordings, inputs, rest, self._tutors(recordings), learned)

    def _tutors(self, recordings: Sequence[Recording]) -> list[np.ndarray]:
        """Return the Tolles-Lawson estimate of the standardized rest, (n,) for each recording: its mean on a stage."""
        settings, fitted = self.settings, self.fitted
        if settings.tutor == 0.0 or settings.first_stage != "none":
            return [np.full(len(recording), -fitted.mean / fitted.scale) for recording in recordings]
        tutor = tutor_of(settings, Training.whole(self.training.recordings, self.training.sensor))
        return [(tutor.interference(recording) - fitted.mean) / fitted.scale for recording in recordings]

    def _checkpoint(self, phase: str, steps: int, lesson: HeldLesson) -> Checkpoint | None:
        about = {**self.identity, "settings": asdict(self.settings), "steps": steps}
        contents = (np.ascontiguousarray(array).tobytes() for array in (*lesson.inputs, *lesson.targets))
        return checkpoint_of(self.context, phase, about, self.fitted.module, contents)
