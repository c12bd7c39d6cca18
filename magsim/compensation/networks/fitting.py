"""Fit a network to what a closed-form first stage leaves: estimate = stage + mean + weight * scale * network(inputs).

The order of training that works: a closed form in float64 first, then the network on the standardized rest. Adam alone
stops at about 1 nT.

Stage and network learn from all folds but one, and are judged on that one, fold by fold. What was not learned tells
after how many steps the in-band error is about least, and how much of the network's output holds
(``magsim.compensation.networks.evidence``). In the end both learn from all rows, for that many steps (Goodfellow,
Bengio and Courville, Deep Learning, 2016, algorithm 7.2). An untrained network returns zeros, and step 0 counts: where
training never helps, the estimate is that of the first stage.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, replace

import numpy as np
import torch
from torch import nn

from magsim.compensation.base import FitContext
from magsim.compensation.networks.evidence import Judge, Unit, share_of
from magsim.compensation.networks.fitted import Fitted, check_rates, target_of
from magsim.compensation.networks.folds import Fold, everything, folds_of
from magsim.compensation.networks.inputs import fit_inputs
from magsim.compensation.networks.losses import Loss, ResidualLoss, TutoredLoss, band_matrix
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.dataset import Training
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, spans
from magsim.streams import integer_seed
from magsim.training import ArrayWindows, Checkpoint, Outcome, RandomBatches, seeded, train

TOLERANCE = 1.1
"""How much worse than the best a validation value may be and still count as about as good."""

LEAST_NT = 1e-6
"""Smallest scale of a residual: below it there is nothing to learn."""

ModuleFactory = Callable[[tuple[str, ...]], nn.Module]
"""Makes a network with its start weights for the names of its input columns."""


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
    run = _Run(settings, training, context, _prepare(settings, module_factory, training, context), dict(identity or {}))
    steps, share, module = settings.steps, 1.0, None
    outcomes: dict[str, Outcome] = {}
    units: list[Unit] = []
    for number, fold in enumerate(folds_of(training, settings.hold_out, settings.folds) if settings.folds else ()):
        phase = f"fold {number + 1}"
        module, outcomes[phase], judge = run(phase, fold, settings.steps)
        units += judge.units(module)
    if outcomes:
        steps = enough_steps(pooled(list(outcomes.values())))
        share = share_of(units) if settings.shrink else float(steps > 0)
    if module is None or settings.refit:
        steps = steps if share > 0.0 else 0
        module, outcomes["all"], _ = run("all", everything(training), steps)
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
    columns = fit_inputs(settings, all_rows(recordings, sensor))
    stage = first_stage(settings).fit_rows(all_rows(recordings, sensor))
    every = np.concatenate(
        [(target_of(settings, r, sensor) - stage.interference(r))[r.reads(sensor)] for r in recordings]
    )
    mean, scale = float(every.mean()), max(float(every.std()), LEAST_NT)
    designs = [columns(recording) for recording in recordings]
    names = designs[0].names
    standardizer = Standardizer.of([design.matrix for design in designs])
    with seeded(integer_seed(context.seed, "compensation/weights")):
        module = module_factory(names)
    module.start_at_zero()  # type: ignore[operator]
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
        module, judge = deepcopy(fitted.module), Judge(fitted, fold.watched, sensor)
        if steps == 0:
            # no step helped: the untrained network, which returns zeros, is the answer
            return module, Outcome(0, judge.value(module), 0, ()), judge
        known = [rows & r.reads(sensor) for r, rows in zip(self.training.recordings, fold.learned, strict=True)]
        pairs = [pair for pair in zip(self.training.recordings, known, strict=True) if pair[1].any()]
        recordings, learned = [recording for recording, _ in pairs], [rows for _, rows in pairs]
        inputs = [fitted.inputs(recording) for recording in recordings]
        rest = [fitted.rest(recording, sensor) / fitted.scale for recording in recordings]
        targets = [np.column_stack(each) for each in zip(rest, self._tutors(recordings), learned, strict=True)]
        batches = self._batches(recordings, inputs, targets)
        outcome = train(
            module,
            batches,
            self._loss(recordings, rest, batches.rows),
            judge.value,
            settings.plan(steps),
            seed=integer_seed(self.context.seed, f"compensation/{phase}/batches"),
            phase=phase,
            progress=self.context.progress,
            checkpoint=self._checkpoint(phase, steps, inputs, targets),
        )
        return module, outcome, judge

    def _tutors(self, recordings: Sequence[Recording]) -> list[np.ndarray]:
        """Return the Tolles-Lawson estimate of the standardized rest, (n,) for each recording: its mean on a stage."""
        settings, fitted = self.settings, self.fitted
        if settings.tutor == 0.0 or settings.first_stage != "none":
            return [np.full(len(recording), -fitted.mean / fitted.scale) for recording in recordings]
        rows = all_rows(self.training.recordings, self.training.sensor)
        tutor = TollesLawson(fluxgate=settings.fluxgate, direction=settings.direction).fit_rows(rows)
        return [(tutor.interference(recording) - fitted.mean) / fitted.scale for recording in recordings]

    def _batches(
        self, recordings: Sequence[Recording], inputs: Sequence[np.ndarray], targets: Sequence[np.ndarray]
    ) -> RandomBatches:
        """Return a sampler of windows in pieces without a gap."""
        settings = self.settings
        cuts = [(number, span) for number, recording in enumerate(recordings) for span in spans(recording.time_s)]
        try:
            sources = [
                ArrayWindows([values[number][span] for number, span in cuts], rows=settings.window)
                for values in (inputs, targets)
            ]
        except ValueError as error:
            raise DataError(str(error)) from None
        return RandomBatches(sources, batch=settings.batch)

    def _loss(self, recordings: Sequence[Recording], rest: Sequence[np.ndarray], rows: int) -> Loss:
        settings = self.settings
        band, weight = None, 0.0
        if settings.band_weight > 0.0 and settings.outputs > 1:
            parts = [in_band(part, recording.time_s) for part, recording in zip(rest, recordings, strict=True)]
            inside = np.concatenate(parts)
            if not len(inside):
                msg = "no training piece is longer than the 60 s that the band-pass spoils"
                raise DataError(msg)
            weight = settings.band_weight / max(float(inside.var()), 1e-12)
            try:
                matrix = band_matrix(settings.outputs, recordings[0].rate_hz)
            except ValueError as error:
                raise RequestError(str(error)) from None
            band = torch.tensor(matrix.T, dtype=torch.float32)
        truth = ResidualLoss(band, weight)
        if settings.tutor > 0.0:
            rows_per_step = settings.batch * settings.outputs
            return TutoredLoss(truth, settings.tutor, rows / rows_per_step)
        return truth

    def _checkpoint(
        self, phase: str, steps: int, inputs: Sequence[np.ndarray], targets: Sequence[np.ndarray]
    ) -> Checkpoint | None:
        if self.context.checkpoint is None:
            return None
        about = {**self.identity, "settings": asdict(self.settings), "seed": self.context.seed, "steps": steps}
        digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
        for array in (*inputs, *targets):
            digest.update(np.ascontiguousarray(array).tobytes())
        return Checkpoint(self.context.checkpoint / phase.replace(" ", "_"), digest.hexdigest())


def all_rows(recordings: Sequence[Recording], sensor: str) -> Training:
    """Return training rows of recordings without a part for validation."""
    return Training(tuple(recordings), tuple(np.zeros(len(recording), dtype=bool) for recording in recordings), sensor)
