"""How a network is brought down to what it has to learn: Adam on random windows, Levenberg-Marquardt on all rows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from torch import nn

from magsim.compensation.networks.losses import DecayedLoss, Loss, ResidualLoss, TutoredLoss, band_matrix
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.squares import LearnedPiece, squares_of
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, spans
from magsim.training import (
    ArrayWindows,
    Checkpoint,
    LevenbergPlan,
    Machine,
    Outcome,
    Progress,
    RandomBatches,
    WindowSource,
    train,
    train_levenberg,
)


class Lesson(Protocol):
    """What a network learns from."""

    @property
    def rate_hz(self) -> float:
        """Rows a second."""

    def sources(self, rows: int) -> Sequence[WindowSource]:
        """Return windows of inputs and of targets: rest, perhaps the tutor's estimate of it, and learned rows.

        Raises
        ------
        ValueError
            If no piece is as long as a window.
        """

    def band_variance(self) -> float:
        """Return the variance of the standardized rest in band.

        Raises
        ------
        DataError
            If no piece is long enough for the band-pass.
        """


@dataclass(frozen=True)
class HeldLesson:
    """What a network learns from, in memory: an array for each recording.

    Attributes
    ----------
    recordings : sequence of Recording
    inputs : sequence of (n, c)
        Standardized.
    rest, tutor : sequence of (n,)
        What the stage leaves, standardized; and the Tolles-Lawson estimate of it.
    learned : sequence of (n,) bool
        Rows that count.
    """

    recordings: Sequence[Recording]
    inputs: Sequence[np.ndarray]
    rest: Sequence[np.ndarray]
    tutor: Sequence[np.ndarray]
    learned: Sequence[np.ndarray]

    @property
    def targets(self) -> list[np.ndarray]:
        """Rest, tutor and learned rows side by side, (n, 3) each."""
        return [np.column_stack(each) for each in zip(self.rest, self.tutor, self.learned, strict=True)]

    @property
    def pieces(self) -> list[tuple[int, slice]]:
        """Pieces without a gap: number of the recording, and its rows."""
        return [(number, span) for number, r in enumerate(self.recordings) for span in spans(r.time_s)]

    @property
    def rate_hz(self) -> float:
        """Rows a second."""
        return self.recordings[0].rate_hz

    def sources(self, rows: int) -> list[ArrayWindows]:
        """Return windows of inputs and of targets; see ``Lesson``."""
        return [
            ArrayWindows([values[number][span] for number, span in self.pieces], rows=rows)
            for values in (self.inputs, self.targets)
        ]

    def band_variance(self) -> float:
        """Return the variance of the standardized rest in band; see ``Lesson``."""
        parts = [in_band(rest, recording.time_s) for rest, recording in zip(self.rest, self.recordings, strict=True)]
        inside = np.concatenate(parts)
        if not len(inside):
            msg = "no training piece is longer than the 60 s that the band-pass spoils"
            raise DataError(msg)
        return float(inside.var())


@dataclass(frozen=True)
class Errand:
    """One training run: most steps, what judges it, its name and seed, who is told, where its state is, on what."""

    steps: int
    measure: Callable[[nn.Module], float]
    phase: str
    seed: int
    progress: Callable[[Progress], None] | None
    checkpoint: Checkpoint | None
    machine: Machine


def descend(settings: NetworkSettings, module: nn.Module, lesson: Lesson, errand: Errand) -> Outcome:
    """Train a network and leave it in its best state.

    Raises
    ------
    RequestError
        If a window is too short for the loss, or the optimizer does not take the network.
    DataError
        If no piece is as long as a window, or training diverges.
    """
    _check(settings, errand.machine)
    return (_levenberg if settings.optimizer == "lm" else _adam)(settings, module, lesson, errand)


def _check(settings: NetworkSettings, machine: Machine) -> None:
    """Refuse settings that the optimizer would not heed, or cannot take."""
    if settings.optimizer == "lm" and (machine.device.startswith("cuda") or machine.precision != "float32"):
        msg = f"optimizer 'lm' trains on the CPU in float64, not on {machine.device} in {machine.precision}"
        raise RequestError(msg)
    if settings.optimizer == "lm" and settings.tutor > 0.0:
        msg = f"tutor {settings.tutor:g} has no effect with optimizer 'lm'; allowed: 0, or optimizer 'adam'"
        raise RequestError(msg)


def _adam(settings: NetworkSettings, module: nn.Module, lesson: Lesson, errand: Errand) -> Outcome:
    try:
        sources = lesson.sources(settings.window)
    except ValueError as error:
        raise DataError(str(error)) from None
    batches = RandomBatches(sources, batch=settings.batch)
    return train(
        module,
        batches,
        _loss(settings, lesson, batches.rows),
        errand.measure,
        settings.plan(errand.steps),
        seed=errand.seed,
        phase=errand.phase,
        progress=errand.progress,
        checkpoint=errand.checkpoint,
        machine=errand.machine,
    )


def _loss(settings: NetworkSettings, lesson: Lesson, rows: int) -> Loss:
    band, weight = None, 0.0
    if settings.band_weight > 0.0 and settings.outputs > 1:
        weight = _band_weight(settings, lesson)
        try:
            matrix = band_matrix(settings.outputs, lesson.rate_hz)
        except ValueError as error:
            raise RequestError(str(error)) from None
        band = torch.tensor(matrix.T, dtype=torch.float32)
    loss: ResidualLoss | TutoredLoss = ResidualLoss(band, weight)
    if settings.tutor > 0.0:
        rows_per_step = settings.batch * settings.outputs
        loss = TutoredLoss(ResidualLoss(band, weight), settings.tutor, rows / rows_per_step)
    return DecayedLoss(loss, settings.weight_decay) if settings.weight_decay > 0.0 else loss


def _band_weight(settings: NetworkSettings, lesson: Lesson) -> float:
    """Return the weight of the in-band error relative to the variance of what there is in band."""
    return settings.band_weight / max(lesson.band_variance(), 1e-12)


def _levenberg(settings: NetworkSettings, module: nn.Module, lesson: Lesson, errand: Errand) -> Outcome:
    """Learn all rows at once, in band too."""
    assert isinstance(lesson, HeldLesson)  # settings that spool are refused
    pieces = [
        LearnedPiece(lesson.inputs[k][span], lesson.rest[k][span], lesson.learned[k][span]) for k, span in lesson.pieces
    ]
    weight = _band_weight(settings, lesson) if settings.band_weight > 0.0 else 0.0
    squares = squares_of(pieces, lesson.rate_hz, context=settings.context, window=settings.window, band_weight=weight)
    plan = LevenbergPlan(
        errand.steps,
        every=settings.every,
        patience=settings.patience,
        weight_decay=settings.weight_decay,
        threads=settings.threads,
    )
    return train_levenberg(
        module,
        squares.inputs,
        squares.targets,
        errand.measure,
        plan,
        weights=squares.weights,
        operator=squares.operator,
        phase=errand.phase,
        progress=errand.progress,
        checkpoint=errand.checkpoint,
    )
