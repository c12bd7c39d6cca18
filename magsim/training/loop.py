"""The training loop: Adam with cosine decay, validation, early stopping, the best state kept."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from magsim.errors import DataError
from magsim.training.checkpoint import Checkpoint, Saved
from magsim.training.determinism import reproducible, seeded
from magsim.training.gradients import project_conflicts
from magsim.training.run import Outcome, Progress, RunState, fitting

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
        Called at each validation, and with the last one that a run has made which is taken up.
    checkpoint : Checkpoint, optional
        Where the state is kept at each validation; a state found there is taken up, and the end is the same as
        without the break.

    Raises
    ------
    DataError
        If the loss or the validation value is not finite.
    """
    with reproducible(plan.threads), seeded(seed):
        loop = _Loop(
            module, batch, losses, measure, plan, seed=seed, phase=phase, progress=progress, checkpoint=checkpoint
        )
        run = loop.go()
        module.load_state_dict(run.best)
        module.eval()
    return run.outcome()


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
        self.run = _resume(saved, module, self.optimizer, self.generator) if saved else RunState()
        self.recent: list[float] = []

    def go(self) -> RunState:
        """Train to the end."""
        run = self.run
        if not run.history:
            self.validate()
        else:
            self.report()
        while not run.done:
            self.step()
            if run.step % self.plan.every == 0 or run.step == self.plan.steps:
                self.validate()
        return run

    def step(self) -> None:
        """One optimizer step."""
        self.module.train()
        # dropout draws from torch's own generator: from a place in it that a resumed run knows too
        torch.manual_seed((self.generator.initial_seed() + self.run.step) % 2**63)
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
        run.done = run.step >= plan.steps or run.stale >= plan.patience
        if self.checkpoint:
            own = {"optimizer": self.optimizer.state_dict(), "generator": self.generator.get_state()}
            self.checkpoint.save(run.step, self.module.state_dict(), run.best, own | run.kept())
        self.report()

    def report(self) -> None:
        """Tell where the run stands."""
        if self.progress:
            rate = self.plan.rate(self.run.step)
            self.progress(self.run.progress(self.phase, self.plan.steps, learning_rate=rate))


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


def _resume(saved: Saved, module: nn.Module, optimizer: torch.optim.Optimizer, generator: torch.Generator) -> RunState:
    with fitting(saved):
        module.load_state_dict(saved.weights)
        optimizer.load_state_dict(saved.state["optimizer"])
        generator.set_state(saved.state["generator"])
        return RunState.of(saved)
