"""The training loop: Adam with cosine decay, validation, early stopping, the best state kept."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor, nn

from magsim.errors import DataError
from magsim.training.checkpoint import Checkpoint, Saved
from magsim.training.determinism import reproducible
from magsim.training.gradients import project_conflicts

Batch = tuple[Tensor, ...]


@dataclass(frozen=True)
class Plan:
    """How long and how fast to train.

    Attributes
    ----------
    steps : int
        Most optimizer steps.
    learning_rate : float
        Of Adam at the start.
    decay : bool
        Cosine decay to 0 over ``steps``, else a constant rate.
    every : int
        Steps between validations.
    patience : int
        Validations without a better value after which to stop.
    surgery : bool
        Free the gradients of several losses from conflicts (PCGrad) instead of adding them.
    threads : int
        CPU threads of torch.
    """

    steps: int
    learning_rate: float = 3e-3
    decay: bool = True
    every: int = 50
    patience: int = 10
    surgery: bool = False
    threads: int = 1

    def rate(self, step: int) -> float:
        """Learning rate of a step, counted from 0."""
        if not self.decay:
            return self.learning_rate
        return 0.5 * self.learning_rate * (1.0 + math.cos(math.pi * step / self.steps))


@dataclass(frozen=True)
class Progress:
    """Where a run stands: for people; nothing of it reaches the result.

    Attributes
    ----------
    phase : str
    step, steps : int
    loss : float
        Mean over the steps since the last report, NaN before the first step.
    valid, best : float
        Validation value now, and the best so far.
    eta_s : float [s]
        Estimated time to the last step.
    """

    phase: str
    step: int
    steps: int
    loss: float
    valid: float
    best: float
    eta_s: float


@dataclass(frozen=True)
class Outcome:
    """What a run came to: the module is left in its best state.

    Attributes
    ----------
    best_step : int
        Steps after which the validation value was least; 0 is the untrained module.
    best_value : float
    steps : int
        Steps that were made.
    history : tuple of (step, loss, value)
    """

    best_step: int
    best_value: float
    steps: int
    history: tuple[tuple[int, float, float], ...]


@dataclass
class _Run:
    """The part of a run that a checkpoint keeps."""

    step: int = 0
    best_step: int = 0
    best_value: float = math.inf
    best: dict[str, Tensor] = field(default_factory=dict)
    history: list[tuple[int, float, float]] = field(default_factory=list)
    done: bool = False

    def note(self, module: nn.Module, loss: float, value: float) -> None:
        """Take in a validation, and the module's state if it is the best."""
        self.history.append((self.step, loss, value))
        if value < self.best_value:
            self.best_step, self.best_value, self.best = self.step, value, _copy(module)


def _copy(module: nn.Module) -> dict[str, Tensor]:
    return {name: tensor.detach().clone() for name, tensor in module.state_dict().items()}


def train(
    module: nn.Module,
    batch: Callable[[torch.Generator], Batch],
    losses: Callable[[nn.Module, Batch, int], Sequence[Tensor]],
    measure: Callable[[nn.Module], float],
    plan: Plan,
    *,
    seed: int,
    phase: str = "train",
    progress: Callable[[Progress], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Outcome:
    """Train a module and leave it in its best state, in evaluation mode.

    Parameters
    ----------
    module : nn.Module
        With its start weights.
    batch : callable
        Draws a batch with the generator that it is given; all randomness of the loop.
    losses : callable
        Maps module, batch and step to one or more losses.
    measure : callable
        Validation value of the module, to be made small; called at step 0, every ``plan.every`` steps and at the end.
    plan : Plan
    seed : int
        Of the generator.
    phase : str
        Name of the run in the progress.
    progress : callable, optional
        Called at each validation.
    checkpoint : Checkpoint, optional
        Where the state is kept at each validation; a state found there is taken up, and the end is the same as
        without the break.

    Raises
    ------
    DataError
        If the loss or the validation value is not finite.
    """
    with reproducible(plan.threads):
        loop = _Loop(
            module, batch, losses, measure, plan, seed=seed, phase=phase, progress=progress, checkpoint=checkpoint
        )
        run = loop.go()
        module.load_state_dict(run.best)
        module.eval()
    return Outcome(run.best_step, run.best_value, run.step, tuple(run.history))


class _Loop:
    """One run of ``train``: its parts and its state."""

    def __init__(
        self,
        module: nn.Module,
        batch: Callable[[torch.Generator], Batch],
        losses: Callable[[nn.Module, Batch, int], Sequence[Tensor]],
        measure: Callable[[nn.Module], float],
        plan: Plan,
        *,
        seed: int,
        phase: str,
        progress: Callable[[Progress], None] | None,
        checkpoint: Checkpoint | None,
    ) -> None:
        self.module, self.batch, self.losses, self.measure, self.plan = module, batch, losses, measure, plan
        self.phase, self.progress, self.checkpoint = phase, progress, checkpoint
        self.optimizer = torch.optim.Adam(module.parameters(), lr=plan.learning_rate)
        self.generator = torch.Generator().manual_seed(seed)
        saved = checkpoint.load() if checkpoint else None
        self.run = _resume(saved, module, self.optimizer, self.generator) if saved else _Run()
        self.recent: list[float] = []
        self.first = self.run.step
        self.started = time.monotonic()

    def go(self) -> _Run:
        """Train to the end."""
        run = self.run
        if not run.history:
            self.validate()
        while not run.done:
            self.step()
            if run.step % self.plan.every == 0 or run.step == self.plan.steps:
                self.validate()
        return run

    def step(self) -> None:
        """One optimizer step."""
        self.module.train()
        for group in self.optimizer.param_groups:
            group["lr"] = self.plan.rate(self.run.step)
        losses = self.losses(self.module, self.batch(self.generator), self.run.step)
        loss = _set_gradients(self.module, losses, surgery=self.plan.surgery)
        if not math.isfinite(loss):
            msg = f"training diverged: the loss at step {self.run.step} is {loss}"
            raise DataError(msg)
        self.optimizer.step()
        self.recent.append(loss)
        self.run.step += 1

    def validate(self) -> None:
        """Measure the module, keep it if it is the best, save the state, report the progress."""
        run, plan = self.run, self.plan
        self.module.eval()
        with torch.no_grad():
            value = float(self.measure(self.module))
        if not math.isfinite(value):
            msg = f"training diverged: the validation value at step {run.step} is {value}"
            raise DataError(msg)
        loss = sum(self.recent) / len(self.recent) if self.recent else math.nan
        self.recent.clear()
        run.note(self.module, loss, value)
        stale = sum(step > run.best_step for step, _, _ in run.history)
        run.done = run.step >= plan.steps or stale >= plan.patience
        if self.checkpoint:
            state = _state(run, self.optimizer, self.generator)
            self.checkpoint.save(run.step, self.module.state_dict(), run.best, state)
        if self.progress:
            eta_s = 0.0 if run.done else self.eta_s()
            self.progress(Progress(self.phase, run.step, plan.steps, loss, value, run.best_value, eta_s))

    def eta_s(self) -> float:
        """Estimated time to the last step [s]; NaN before the first."""
        made = self.run.step - self.first
        return (time.monotonic() - self.started) / made * (self.plan.steps - self.run.step) if made else math.nan


def _set_gradients(module: nn.Module, losses: Sequence[Tensor], *, surgery: bool) -> float:
    """Put the gradient of the losses into the parameters; returns their sum."""
    module.zero_grad()
    total = torch.stack(list(losses)).sum()
    if not (surgery and len(losses) > 1):
        total.backward()
        return float(total.detach())
    parameters = [parameter for parameter in module.parameters() if parameter.requires_grad]
    gradients = [
        torch.nn.utils.parameters_to_vector(
            torch.autograd.grad(loss, parameters, retain_graph=True, materialize_grads=True)
        )
        for loss in losses
    ]
    merged = project_conflicts(gradients)
    for parameter in parameters:
        count = parameter.numel()
        parameter.grad, merged = merged[:count].reshape(parameter.shape).clone(), merged[count:]
    return float(total.detach())


def _state(run: _Run, optimizer: torch.optim.Optimizer, generator: torch.Generator) -> dict[str, Any]:
    return {
        "optimizer": optimizer.state_dict(),
        "generator": generator.get_state(),
        "best_step": run.best_step,
        "best_value": run.best_value,
        "history": [list(row) for row in run.history],
        "done": run.done,
    }


def _resume(saved: Saved, module: nn.Module, optimizer: torch.optim.Optimizer, generator: torch.Generator) -> _Run:
    try:
        module.load_state_dict(saved.weights)
        optimizer.load_state_dict(saved.state["optimizer"])
        generator.set_state(saved.state["generator"])
        history = [(int(step), float(loss), float(value)) for step, loss, value in saved.state["history"]]
        best_step, best_value = int(saved.state["best_step"]), float(saved.state["best_value"])
        done = bool(saved.state["done"])
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        msg = f"the checkpoint of step {saved.step} does not fit the network: {error}"
        raise DataError(msg) from None
    return _Run(saved.step, best_step, best_value, saved.best, history, done)
