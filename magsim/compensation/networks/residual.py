"""Fit a network to what a closed-form first stage leaves: estimate = stage + mean + scale * network(inputs).

The order of training that works: a closed form in float64 first, then the network on the standardized rest. Adam alone
stops at about 1 nT.

The training has two runs. The first learns from a part of the calibration and finds the number of steps after which the
in-band error on the rest, which it never learned from, is about least. The second learns from all of it for that many
steps (Goodfellow, Bengio and Courville, Deep Learning, 2016, algorithm 7.2). An untrained network returns zeros, and
step 0 counts: where training never helps, the estimate is that of the first stage.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np
import torch
from torch import nn

from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.networks import holdout
from magsim.compensation.networks.holdout import Watched
from magsim.compensation.networks.inputs import InputColumns, fit_inputs
from magsim.compensation.networks.losses import Loss, ResidualLoss, TutoredLoss, band_matrix
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage
from magsim.compensation.networks.windows import apply_network
from magsim.compensation.targets import interference, reading_rows
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


class ZeroStart(Protocol):
    """What a network has beside ``nn.Module``."""

    def start_at_zero(self) -> None:
        """Set the last layer to zero, so that the untrained network returns zeros."""


ModuleFactory = Callable[[tuple[str, ...]], nn.Module]
"""Makes a network with its start weights for named input columns; the network is a ``ZeroStart`` too."""


@dataclass(frozen=True)
class Fitted:
    """A trained pair of first stage and network with the scales between them.

    Attributes
    ----------
    settings : NetworkSettings
    stage : Compensator
    columns : InputColumns
        Inputs of the network.
    names : tuple of str
        Of the input columns.
    standardizer : Standardizer
    mean, scale : float [nT]
    module : nn.Module
    rate_hz : float [Hz]
        Rate of the training rows: windows count rows, so a network knows one rate only.
    """

    settings: NetworkSettings
    stage: Compensator
    columns: InputColumns
    names: tuple[str, ...]
    standardizer: Standardizer
    mean: float
    scale: float
    module: nn.Module
    rate_hz: float

    def inputs(self, recording: Recording) -> np.ndarray:
        """Return the standardized columns, (n, c) float32."""
        return self.standardizer(self.columns(recording).matrix).astype(np.float32)

    def output(self, module: nn.Module, inputs: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the output of a network over a recording, (n,), NaN in the warm-up."""
        settings = self.settings
        return apply_network(module, inputs, time_s, window=settings.window, stride=settings.stride, last=settings.last)


def fit_residual(
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
        With ``hold_out="legs"`` and no validation rows the second run alone is made.
    context : FitContext
    identity : mapping, optional
        What a checkpoint belongs to beside settings, seed and data: name and parameters of the method.

    Returns
    -------
    Fitted
    dict of str to Outcome
        Result of each run: ``select`` and ``refit``.

    Raises
    ------
    RequestError
        If a window is too short for the loss, or a column or label is missing.
    DataError
        If the recordings are too short, of different rates or not finite, or training diverges.
    """
    rate_hz = training.recordings[0].rate_hz
    for recording in training.recordings:
        check_rate(recording, rate_hz)
    run = _Run(settings, module_factory, training.sensor, context, rate_hz, dict(identity or {}))
    both = training.recordings
    learned, watched = holdout.blocks(both) if settings.hold_out == "blocks" else holdout.legs(training)
    steps, outcomes, fitted = settings.steps, {}, None
    if watched:
        fitted, outcomes["select"] = run("select", learned, watched, steps)
        steps = enough_steps(outcomes["select"])
    if fitted is None or settings.refit:
        fitted, outcomes["refit"] = run("refit", both, holdout.whole(both), steps)
    return fitted, outcomes


def check_rate(recording: Recording, rate_hz: float) -> None:
    """Refuse a recording of another rate than the training rows.

    Raises
    ------
    DataError
    """
    check_rate_hz(f"recording {recording.name!r}", recording.rate_hz, rate_hz)


def check_rate_hz(what: str, found_hz: float, rate_hz: float) -> None:
    """Refuse another rate than that of the training rows.

    Raises
    ------
    DataError
    """
    if abs(found_hz / rate_hz - 1.0) > 0.01:
        msg = f"{what} has {found_hz:g} rows a second; the network learned from {rate_hz:g}"
        raise DataError(msg)


def enough_steps(outcome: Outcome) -> int:
    """Return the steps for a second run: the last that did about as well as the best, 0 if none beat the start.

    The curve is flat and noisy near its least value, and a second run with more data bears more steps.
    """
    if outcome.best_step == 0:
        return 0
    return max(step for step, _, value in outcome.history if value <= TOLERANCE * outcome.best_value)


@dataclass(frozen=True)
class _Run:
    """One training run: settings and surroundings; called with the rows."""

    settings: NetworkSettings
    module_factory: ModuleFactory
    sensor: str
    context: FitContext
    rate_hz: float
    identity: dict[str, object]

    def __call__(
        self, phase: str, recordings: Sequence[Recording], watched: Sequence[Watched], steps: int
    ) -> tuple[Fitted, Outcome]:
        """Fit stage and network on recordings; the best state by the in-band error on the watched rows."""
        settings = self.settings
        uncut, recordings = recordings, reading_rows(recordings, self.sensor)
        fitted, rest, tutor = self._prepare(uncut, recordings)
        inputs = [fitted.inputs(recording) for recording in recordings]
        targets = [np.column_stack(pair) for pair in zip(rest, tutor, strict=True)]
        batches = self._batches(recordings, inputs, targets)
        measure = self._measure(fitted, watched)
        if steps == 0:
            # The first run found that no step helps: the untrained network, which returns zeros, is the answer.
            return fitted, Outcome(0, measure(fitted.module), 0, ())
        outcome = train(
            fitted.module,
            batches,
            self._loss(recordings, rest, batches.rows),
            measure,
            settings.plan(steps),
            seed=integer_seed(self.context.seed, f"compensation/{phase}/batches"),
            phase=phase,
            progress=self.context.progress,
            checkpoint=self._checkpoint(phase, steps, inputs, targets),
        )
        return fitted, outcome

    def _prepare(
        self, uncut: Sequence[Recording], recordings: Sequence[Recording]
    ) -> tuple[Fitted, list[np.ndarray], list[np.ndarray]]:
        """Fit the stage, find the scales and make the network.

        The stage cuts dropouts by itself, as its target asks for; windows must not span them.

        Returns
        -------
        fitted : Fitted
            With the untrained network.
        rest, tutor : list of (n,)
            The standardized rest, and the Tolles-Lawson estimate of it.
        """
        settings, sensor = self.settings, self.sensor
        truths = [interference(recording, sensor) for recording in recordings]
        columns = fit_inputs(settings, all_rows(uncut, sensor))
        stage = first_stage(settings).fit_rows(all_rows(uncut, sensor))
        first = [stage.interference(recording) for recording in recordings]
        rest = [truth - estimate for truth, estimate in zip(truths, first, strict=True)]
        every = np.concatenate(rest)
        mean, scale = float(every.mean()), max(float(every.std()), LEAST_NT)
        designs = [columns(recording) for recording in recordings]
        names = designs[0].names
        standardizer = Standardizer.of([design.matrix for design in designs])
        with seeded(integer_seed(self.context.seed, "compensation/weights")):
            module = self.module_factory(names)
        module.start_at_zero()  # type: ignore[operator]
        fitted = Fitted(settings, stage, columns, names, standardizer, mean, scale, module, self.rate_hz)
        guesses = first
        if settings.tutor > 0.0 and settings.first_stage == "none":
            tutor = TollesLawson(fluxgate=settings.fluxgate, direction=settings.direction).fit_rows(
                all_rows(uncut, sensor)
            )
            guesses = [tutor.interference(recording) for recording in recordings]
        tutors = [(guess - base - mean) / scale for guess, base in zip(guesses, first, strict=True)]
        return fitted, [(part - mean) / scale for part in rest], tutors

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
        if settings.band_weight > 0.0 and not settings.last:
            parts = [in_band(part, recording.time_s) for part, recording in zip(rest, recordings, strict=True)]
            inside = np.concatenate(parts)
            if not len(inside):
                msg = "no training piece is longer than the 60 s that the band-pass spoils"
                raise DataError(msg)
            weight = settings.band_weight / max(float(inside.var()), 1e-12)
            try:
                matrix = band_matrix(settings.window, recordings[0].rate_hz)
            except ValueError as error:
                raise RequestError(str(error)) from None
            band = torch.tensor(matrix.T, dtype=torch.float32)
        truth = ResidualLoss(band, weight, settings.last)
        if settings.tutor > 0.0:
            rows_per_step = settings.batch * (1 if settings.last else settings.window)
            return TutoredLoss(truth, settings.tutor, rows / rows_per_step)
        return truth

    def _measure(self, fitted: Fitted, watched: Sequence[Watched]) -> Callable[[nn.Module], float]:
        """Return the in-band STD of the error on the watched rows [nT], as a function of the network."""
        parts = [
            (
                recording.time_s,
                fitted.inputs(recording),
                interference(recording, self.sensor) - fitted.stage.interference(recording) - fitted.mean,
                rows & recording.reads(self.sensor),
            )
            for recording, rows in watched
        ]

        def measure(module: nn.Module) -> float:
            kept = []
            for time_s, inputs, rest, rows in parts:
                out = fitted.output(module, inputs, time_s)
                known = np.isfinite(out)
                if known.sum() >= 2:
                    # rows beside what is watched are filtered with it, so that a block needs no cropping
                    kept.append(in_band((rest - fitted.scale * out)[known], time_s[known], rows[known]))
            errors = np.concatenate(kept) if kept else np.empty(0)
            if not len(errors):
                msg = (
                    "no row to stop training by is left after the warm-up and the 30 s that the band-pass spoils at "
                    "each end of a piece"
                )
                raise DataError(msg)
            return float(errors.std())

        return measure

    def _checkpoint(
        self, phase: str, steps: int, inputs: Sequence[np.ndarray], targets: Sequence[np.ndarray]
    ) -> Checkpoint | None:
        if self.context.checkpoint is None:
            return None
        about = {**self.identity, "settings": asdict(self.settings), "seed": self.context.seed, "steps": steps}
        digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
        for array in (*inputs, *targets):
            digest.update(np.ascontiguousarray(array).tobytes())
        return Checkpoint(self.context.checkpoint / phase, digest.hexdigest())


def all_rows(recordings: Sequence[Recording], sensor: str) -> Training:
    """Return training rows of recordings without a part for validation."""
    return Training(tuple(recordings), tuple(np.zeros(len(recording), dtype=bool) for recording in recordings), sensor)
