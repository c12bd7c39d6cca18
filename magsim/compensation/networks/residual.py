"""A network on what a Tolles-Lawson stage leaves: estimate = I_TL + mean + scale * network(inputs).

The order of training that works: a closed-form stage in float64 first, then the network on the standardized rest.
Adam alone stops at about 1 nT.
"""

import hashlib
import json
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import torch
from pydantic import Field
from safetensors.torch import load_file, save
from torch import nn

from magsim import columns
from magsim.compensation.base import Compensator, check_recordings, labels, pick_fluxgate, reading_rows
from magsim.compensation.features import Inputs, Standardizer, design, requirements, spans
from magsim.compensation.networks.holdout import Watched, blocks, whole
from magsim.compensation.networks.losses import ResidualLoss, TutoredLoss, band_matrix
from magsim.compensation.tolles_lawson import Nothing, TollesLawson, in_band
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.storage import atomic_write
from magsim.streams import integer_seed
from magsim.training import (
    Checkpoint,
    Outcome,
    Plan,
    Progress,
    RandomWindows,
    overlap_add,
    reproducible,
    seeded,
    train,
)

WEIGHTS = "weights.safetensors"
TOLERANCE = 1.1
"""How much worse than the best a validation value may be and still count as about as good."""

LEAST_NT = 1e-6
"""Smallest scale of a residual: below it there is nothing to learn."""

Count = Annotated[int, Field(ge=1)]
Weight = Annotated[float, Field(ge=0.0)]
Rate = Annotated[float, Field(gt=0.0, le=1.0)]
Stage = Literal["none", "tl16", "tl18", "tl16_measured", "tl18_measured"]
Features = Annotated[tuple[Literal["tl16", "tl18", "attitude"], ...], Field(min_length=1)]


@dataclass(frozen=True)
class _Fitted:
    """A trained pair of stage and network with the scales between them."""

    stage: Compensator
    inputs: Inputs
    names: tuple[str, ...]
    standardizer: Standardizer
    mean: float
    scale: float
    module: nn.Module


@dataclass(kw_only=True, eq=False, repr=False)
class ResidualNetwork(Compensator):
    """Common half of the neural methods: everything but the network itself.

    The training has two runs. The first learns from a part of the calibration and finds the number of steps after
    which the in-band error on the rest, which it never learned from, is about least. The second learns from all of
    it for that many steps (Goodfellow, Bengio and Courville, Deep Learning, 2016, algorithm 7.2). ``refit=False``
    keeps the best state of the first. An untrained network puts out nothing, and step 0 counts: where training never
    helps, the estimate is that of the Tolles-Lawson stage.

    Subclasses give the network, ``last`` (it puts out the last sample of a window only) and their own parameters.
    All share these:

    Parameters
    ----------
    features : tuple of str
        Feature sets that the network reads.
    first_stage : str
        Closed-form stage: ``none`` or a Tolles-Lawson method.
    stage_band : {"in", "broad"}
        How the stage is fitted.
    fluxgate : str, optional
        The first one of the first recording if not given.
    scale : {"constant", "sample"}
        Field strength in the Tolles-Lawson columns; see ``TollesLawson``.
    window : int
        Rows of a window.
    stride : int
        Rows between windows in use.
    band_weight : float
        Weight of the in-band error in the loss, beside the broadband error with weight 1; both relative to what the
        stage leaves.
    tutor : float
        Decay rate v of paper 000's loss for each epoch; 0 learns the truth alone.
    surgery : bool
        Free the gradients of the two losses of ``tutor`` from conflicts.
    hold_out : {"legs", "blocks"}
        What the first run is judged on: the validation recordings, or blocks of time out of training and validation
        recordings. A validation leg flies a heading that no training leg has taught, and either can stop at step 0;
        ``docs/compensators.md`` has what both give.
    steps, batch, learning_rate, decay, every, patience, threads
        See ``magsim.training.Plan``.
    refit : bool
        Make the second run.

    Attributes
    ----------
    outcomes_ : dict of str to Outcome
        What each run came to: ``select`` and ``refit``.
    rate_hz_ : float [Hz]
        Rate of the training rows.
    """

    resumable: ClassVar[bool] = True
    last: ClassVar[bool] = False

    features: Features = ("tl16", "attitude")
    first_stage: Stage = "tl16"
    stage_band: Literal["in", "broad"] = "in"
    fluxgate: str | None = None
    scale: Literal["constant", "sample"] = "constant"
    window: Count = 320
    stride: Count = 80
    band_weight: Weight = 1.0
    tutor: Weight = 0.0
    surgery: bool = False
    steps: Count = 3000
    batch: Count = 16
    learning_rate: Rate = 3e-3
    decay: bool = True
    every: Count = 100
    patience: Count = 10
    hold_out: Literal["legs", "blocks"] = "legs"
    refit: bool = True
    threads: Count = 1

    @abstractmethod
    def make_module(self, channels: int) -> nn.Module:
        """The network with its start weights; it has ``start_at_zero``."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """Patterns of the column families that are read."""
        stage = () if self.first_stage == "none" else ("tl16",)
        return requirements((*self.features, *stage))

    @property
    def causal(self) -> bool:  # type: ignore[override]
        """Overlapping windows look ahead, windows that end at the output do not."""
        return self.last

    @property
    def warmup_s(self) -> float:  # type: ignore[override]
        """One window where only its last sample is put out; taken at 10 Hz before ``fit`` has seen a rate."""
        return (self.window - 1) / getattr(self, "rate_hz_", 10.0) if self.last else 0.0

    def fit(
        self,
        train: Sequence[Recording],
        *,
        sensor: str,
        valid: Sequence[Recording] = (),
        seed: int = 0,
        progress: Callable[[Progress], None] | None = None,
        checkpoint: Path | None = None,
    ) -> Self:
        """Train; see ``Compensator.fit``.

        Parameters
        ----------
        train, valid, sensor, seed
            As in ``Compensator.fit``. With ``hold_out="legs"`` and no ``valid`` the second run alone is made.
        progress : callable, optional
            Told at each validation.
        checkpoint : Path, optional
            Folder for the state of the runs; what it holds is taken up.
        """
        check_recordings([*train, *valid], sensor)
        self.set_params(**self.get_params())
        self.rate_hz_ = train[0].rate_hz
        for recording in (*train, *valid):
            self._check_rate(recording)
        run = _Runs(self, sensor, seed, progress, checkpoint)
        both = [*train, *valid]
        learned, watched = blocks(both) if self.hold_out == "blocks" else (train, whole(valid))
        steps = self.steps
        self.outcomes_: dict[str, Outcome] = {}
        if watched:
            fitted, self.outcomes_["select"] = run("select", learned, watched, steps)
            steps = enough_steps(self.outcomes_["select"])
        if not watched or self.refit:
            fitted, self.outcomes_["refit"] = run("refit", both, whole(both), steps)
        self._fitted = fitted
        self.sensor_ = sensor
        return self

    def interference(self, recording: Recording) -> np.ndarray:
        """Stage plus network, (n,) [nT]."""
        self._require_fitted()
        self._check_rate(recording)
        fitted = self._fitted
        inputs = self.network_inputs(fitted, recording)
        with reproducible(self.threads):
            out = self.apply(fitted.module, inputs, recording.time_s)
        return fitted.stage.interference(recording) + fitted.mean + fitted.scale * out

    def _check_rate(self, recording: Recording) -> None:
        """Windows count rows, so a network knows one rate only."""
        if abs(recording.rate_hz / self.rate_hz_ - 1.0) > 0.01:
            msg = (
                f"recording {recording.name!r} has {recording.rate_hz:g} rows a second; "
                f"method {self.name} learned from {self.rate_hz_:g}"
            )
            raise DataError(msg)

    def network_inputs(self, fitted: _Fitted, recording: Recording) -> np.ndarray:
        """Standardized columns, (n, c) float32."""
        return fitted.standardizer(design(recording, fitted.inputs, self.features).matrix).astype(np.float32)

    def apply(self, module: nn.Module, inputs: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Output of the network over a recording, (n,), piece by piece; NaN in the warm-up."""
        module.eval()

        def function(windows: np.ndarray) -> np.ndarray:
            with torch.no_grad():
                return module(torch.from_numpy(windows)).numpy().astype(float)

        out = np.full(len(inputs), np.nan)
        for span in spans(time_s):
            piece = inputs[span]
            if not self.last:
                out[span] = overlap_add(function, piece, length=self.window, stride=self.stride)
            elif len(piece) >= self.window:
                windows = np.lib.stride_tricks.sliding_window_view(piece, self.window, axis=0)
                parts = [function(windows[i : i + 256].copy())[:, 0] for i in range(0, len(windows), 256)]
                out[span.start + self.window - 1 : span.stop] = np.concatenate(parts)
        return out

    def make_stage(self, fluxgate: str | None) -> Compensator:
        """The unfitted closed-form stage."""
        if self.first_stage == "none":
            return Nothing()
        measured = self.first_stage.endswith("_measured")
        return TollesLawson(
            terms=18 if "18" in self.first_stage else 16,
            target="measured" if measured else "interference",
            band="in" if measured else self.stage_band,
            fluxgate=fluxgate,
            scale=self.scale,
        )

    def _learned(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        fitted = self._fitted
        values, arrays = fitted.stage._learned()
        arrays = {f"stage.{name}": array for name, array in arrays.items()}
        arrays |= {"input_mean": fitted.standardizer.mean, "input_scale": fitted.standardizer.scale}
        outcomes = {
            name: {"best_step": o.best_step, "best_value": o.best_value, "steps": o.steps}
            for name, o in self.outcomes_.items()
        }
        return {
            "stage": values,
            "rate_hz": self.rate_hz_,
            "fluxgate": fitted.inputs.fluxgate,
            "strength_nt": fitted.inputs.strength_nt,
            "names": list(fitted.names),
            "mean_nt": fitted.mean,
            "scale_nt": fitted.scale,
            "outcomes": outcomes,
        }, arrays

    def _restore(self, values: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        stage = self.make_stage(values["fluxgate"])
        prefix = "stage."
        own = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
        stage._restore(values["stage"], own)
        stage.sensor_ = ""
        names = tuple(values["names"])
        standardizer = Standardizer(arrays["input_mean"], arrays["input_scale"])
        if standardizer.mean.shape != (len(names),) or standardizer.scale.shape != (len(names),):
            msg = f"input scales of shape {standardizer.mean.shape} for {len(names)} inputs"
            raise ValueError(msg)
        inputs = Inputs(values["fluxgate"], strength_nt=values["strength_nt"])
        with seeded(0):
            module = self.make_module(len(names))
        self.rate_hz_ = float(values["rate_hz"])
        mean, scale = float(values["mean_nt"]), float(values["scale_nt"])
        self._fitted = _Fitted(stage, inputs, names, standardizer, mean, scale, module)
        self.outcomes_ = {name: Outcome(**kept, history=()) for name, kept in values["outcomes"].items()}

    def _save_more(self, folder: Path) -> None:
        tensors = {name: tensor.contiguous() for name, tensor in self._fitted.module.state_dict().items()}
        atomic_write(folder / WEIGHTS, lambda path: path.write_bytes(save(tensors)), force=True)

    def _load_more(self, folder: Path) -> None:
        try:
            self._fitted.module.load_state_dict(load_file(folder / WEIGHTS))
        except Exception as error:  # safetensors and torch raise their own kinds
            msg = f"{folder / WEIGHTS}: {error}"
            raise ValueError(msg) from None
        self._fitted.module.eval()


def enough_steps(outcome: Outcome) -> int:
    """Steps for a second run: the last that did about as well as the best, 0 if none beat the start.

    The curve is flat and noisy near its least value, and a second run with more data bears more steps.
    """
    if outcome.best_step == 0:
        return 0
    return max(step for step, _, value in outcome.history if value <= TOLERANCE * outcome.best_value)


@dataclass(frozen=True)
class _Runs:
    """Makes the training runs of one fit."""

    owner: ResidualNetwork
    sensor: str
    seed: int
    progress: Callable[[Progress], None] | None
    checkpoint: Path | None

    def __call__(
        self, phase: str, recordings: Sequence[Recording], watched: Sequence[Watched], steps: int
    ) -> tuple[_Fitted, Outcome]:
        """Fit stage and network on recordings; the best state by the in-band error on the watched ones."""
        owner = self.owner
        uncut, recordings = recordings, reading_rows(recordings, self.sensor)
        fitted, rest, tutor = self._prepare(uncut, recordings)
        inputs = [owner.network_inputs(fitted, recording) for recording in recordings]
        targets = [np.column_stack(pair) for pair in zip(rest, tutor, strict=True)]
        pieces = [
            (x[span], y[span])
            for recording, x, y in zip(recordings, inputs, targets, strict=True)
            for span in spans(recording.time_s)
        ]
        try:
            batches = RandomWindows(*zip(*pieces, strict=True), length=owner.window, batch=owner.batch)
        except ValueError as error:
            msg = f"method {owner.name}: {error}"
            raise DataError(msg) from None
        plan = Plan(
            max(steps, 1), owner.learning_rate, owner.decay, owner.every, owner.patience, owner.surgery, owner.threads
        )
        if steps == 0:
            # The first run said that no step helps: the untrained network, which puts out nothing, is the answer.
            return fitted, Outcome(0, self._watch(fitted, watched)(fitted.module), 0, ())
        checkpoint = self._checkpoint(phase, steps, inputs, targets)
        outcome = train(
            fitted.module,
            batches,
            self._loss(recordings, rest, batches.rows),
            self._watch(fitted, watched),
            plan,
            seed=integer_seed(self.seed, f"compensation/{phase}/batches"),
            phase=phase,
            progress=self.progress,
            checkpoint=checkpoint,
        )
        return fitted, outcome

    def _prepare(
        self, uncut: Sequence[Recording], recordings: Sequence[Recording]
    ) -> tuple[_Fitted, list[np.ndarray], list[np.ndarray]]:
        """Stage, scales and the untrained network; the standardized rest and what Tolles-Lawson says of it.

        The stage cuts dropouts by itself, as its target asks for; windows must not span them.
        """
        owner, sensor = self.owner, self.sensor
        truths = [labels(recording, sensor) for recording in recordings]
        fluxgate = pick_fluxgate(recordings, owner.fluxgate)
        stage = owner.make_stage(fluxgate).fit(uncut, sensor=sensor)
        first = [stage.interference(recording) for recording in recordings]
        rest = [truth - estimate for truth, estimate in zip(truths, first, strict=True)]
        every = np.concatenate(rest)
        mean, scale = float(every.mean()), max(float(every.std()), LEAST_NT)
        strength = None
        if owner.scale == "constant":
            readings = np.concatenate([r.vector(columns.FLUX, sensor=fluxgate) for r in recordings])
            strength = float(np.linalg.norm(readings, axis=1).mean())
        inputs = Inputs(fluxgate, strength_nt=strength)
        designs = [design(recording, inputs, owner.features) for recording in recordings]
        standardizer = Standardizer.of([d.matrix for d in designs])
        with seeded(integer_seed(self.seed, "compensation/weights")):
            module = owner.make_module(len(designs[0].names))
        module.start_at_zero()
        fitted = _Fitted(stage, inputs, designs[0].names, standardizer, mean, scale, module)
        said = first
        if owner.tutor > 0.0 and owner.first_stage == "none":
            tutor = TollesLawson(fluxgate=fluxgate).fit(uncut, sensor=sensor)
            said = [tutor.interference(recording) for recording in recordings]
        tutors = [(guess - base - mean) / scale for guess, base in zip(said, first, strict=True)]
        return fitted, [(part - mean) / scale for part in rest], tutors

    def _loss(
        self, recordings: Sequence[Recording], rest: Sequence[np.ndarray], rows: int
    ) -> ResidualLoss | TutoredLoss:
        owner = self.owner
        band, weight = None, 0.0
        if owner.band_weight > 0.0 and not owner.last:
            parts = [in_band(part, recording.time_s) for part, recording in zip(rest, recordings, strict=True)]
            inside = np.concatenate(parts)
            if not len(inside):
                msg = f"method {owner.name}: no training piece is longer than the 60 s that the band-pass spoils"
                raise DataError(msg)
            weight = owner.band_weight / max(float(inside.var()), 1e-12)
            try:
                matrix = band_matrix(owner.window, recordings[0].rate_hz)
            except ValueError as error:
                msg = f"method {owner.name}: {error}"
                raise RequestError(msg) from None
            band = torch.tensor(matrix.T, dtype=torch.float32)
        truth = ResidualLoss(band, weight, owner.last)
        if owner.tutor > 0.0:
            return TutoredLoss(truth, owner.tutor, rows / (owner.batch * (1 if owner.last else owner.window)))
        return truth

    def _watch(self, fitted: _Fitted, watched: Sequence[Watched]) -> Callable[[nn.Module], float]:
        """In-band STD of the error on the watched rows [nT], as a function of the network."""
        owner = self.owner
        parts = [
            (
                recording.time_s,
                owner.network_inputs(fitted, recording),
                labels(recording, self.sensor) - fitted.stage.interference(recording) - fitted.mean,
                rows & recording.reads(self.sensor),
            )
            for recording, rows in watched
        ]

        def measure(module: nn.Module) -> float:
            kept = []
            for time_s, inputs, rest, rows in parts:
                out = owner.apply(module, inputs, time_s)
                known = np.isfinite(out)
                if known.sum() >= 2:
                    # rows beside what is watched are filtered with it, so that a block needs no cropping
                    kept.append(in_band((rest - fitted.scale * out)[known], time_s[known], rows[known]))
            errors = np.concatenate(kept) if kept else np.empty(0)
            if not len(errors):
                msg = (
                    f"method {owner.name}: no row to stop training by is left after the warm-up of "
                    f"{owner.warmup_s:g} s and the 30 s that the band-pass spoils at each end of a piece"
                )
                raise DataError(msg)
            return float(errors.std())

        return measure

    def _checkpoint(
        self, phase: str, steps: int, inputs: Sequence[np.ndarray], targets: Sequence[np.ndarray]
    ) -> Checkpoint | None:
        if self.checkpoint is None:
            return None
        owner = self.owner
        about = {"method": owner.name, "params": owner.get_params(), "seed": self.seed, "steps": steps}
        digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
        for array in (*inputs, *targets):
            digest.update(np.ascontiguousarray(array).tobytes())
        return Checkpoint(self.checkpoint / phase, digest.hexdigest())
