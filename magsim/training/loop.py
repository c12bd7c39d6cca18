"""The training loop: Adam with cosine decay, validation, early stopping, the best state kept."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from magsim.errors import DataError
from magsim.training import distributed
from magsim.training.checkpoint import Checkpoint, Saved
from magsim.training.determinism import generator_states, reproducible, seeded, set_generator_states
from magsim.training.devices import CPU, Machine, find_device, in_precision
from magsim.training.gradients import project_conflicts
from magsim.training.run import Outcome, Progress, RunState, fitting
from magsim.training.weights import first_not_finite, put_weights

Batch = tuple[Tensor, ...]

LARGE = 8_000_000
"""Numbers of an array that is made and dropped before training: 32 MB in float32. Once one of this size was dropped,
the allocator of glibc keeps up to 64 MB for the next arrays; before, it gives those of each step back to the system and
has new ones cleared, which takes a tenth of a training (measured)."""


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
    machine: Machine = CPU,
) -> Outcome:
    """Train a module and leave it in its best state, in evaluation mode and on the CPU.

    Of several processes that torchrun has started, each takes its share of every batch, and the gradient is that of
    all; what is random inside the network is not the same as with one process.

    Parameters
    ----------
    module : nn.Module
        With its start weights. Parameters that need no gradient stay as they are.
    batch : callable
        Draws this process's share of a batch with the generator that it is given (``RandomBatches`` does).
    losses : callable
        Maps module, batch and step to one or more losses, each a mean over the windows of the batch.
    measure : callable
        Validation value of the module, to be made small; called at step 0, every ``plan.every`` steps and at the end.
    plan : Plan
    seed : int
        Of the generator, and of torch's own for what is random inside the network.
    phase : str
        Name of the run in the progress.
    progress : callable, optional
        Called at each validation by the first process, and with the last one that a run has made which is taken up.
    checkpoint : Checkpoint, optional
        Where the state is kept at each validation, and between them as it says; a state found there is taken up, and
        the end is the same as without the break.
    machine : Machine
        Device and precision. Module and batches are moved to the device; so ``losses`` and ``measure`` find them there.

    Raises
    ------
    RequestError
        If the device is not there, or the precision does not help on it.
    DataError
        If the loss, the weights or the validation value are not finite: the module is left in the best state before,
        and a checkpoint holds the last one. If the checkpoint is broken or of another network.
    """
    distributed.join()
    device = find_device(machine.device)
    with reproducible(plan.threads, deterministic=machine.deterministic), seeded(seed, device):
        torch.empty(LARGE)
        module.to(device)
        try:
            loop = _Loop(
                module,
                batch,
                losses,
                measure,
                plan,
                seed=seed,
                device=device,
                precision=machine.precision,
                checkpoint=checkpoint,
            )
            shown = progress if distributed.rank() == 0 else None
            try:
                loop.go(lambda run, rate: shown and shown(run.progress(phase, plan.steps, learning_rate=rate)))
            finally:
                if loop.run.best:
                    module.load_state_dict(loop.run.best)
        finally:
            module.to("cpu").eval()
    return loop.run.outcome()


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
        device: torch.device,
        precision: str,
        checkpoint: Checkpoint | None,
    ) -> None:
        self.module, self.batch, self.losses, self.measure, self.plan = module, batch, losses, measure, plan
        self.device, self.checkpoint = device, checkpoint
        self.computed = in_precision(module, precision, device)
        self.parameters = [parameter for parameter in module.parameters() if parameter.requires_grad]
        self.optimizer = torch.optim.Adam(self.parameters, lr=plan.learning_rate, fused=True)
        self.generator = torch.Generator().manual_seed(seed)
        self.recent: list[float] = []
        self.run = RunState()
        saved = checkpoint.load() if checkpoint else None
        if saved:
            self.resume(saved)

    def go(self, report: Callable[[RunState, float], object]) -> None:
        """Train to the end."""
        run, plan = self.run, self.plan
        if not run.history:
            self.validate()
        report(run, plan.rate(run.step))
        while not run.done:
            self.step()
            if run.step % plan.every == 0 or run.step == plan.steps:
                self.validate()
                report(run, plan.rate(run.step))
            elif self.checkpoint and self.checkpoint.is_due:
                self.save()

    def step(self) -> None:
        """One optimizer step."""
        self.module.train()
        for group in self.optimizer.param_groups:
            group["lr"] = self.plan.rate(self.run.step)
        batch = tuple(part.to(self.device, non_blocking=True) for part in self.batch(self.generator))
        losses = self.losses(self.computed, batch, self.run.step)
        loss = _set_gradients(self.parameters, losses, surgery=self.plan.surgery)
        if not math.isfinite(loss):
            what = f"the loss at step {self.run.step} is {loss}"
            raise self.diverged(what)
        self.optimizer.step()
        self.recent.append(loss)
        self.run.step += 1

    def validate(self) -> None:
        """Measure the module, keep it if it is the best, save the state."""
        run, plan = self.run, self.plan
        self.check_weights()
        self.module.eval()
        with torch.no_grad():
            value = distributed.agreed(float(self.measure(self.module)))
        if not math.isfinite(value):
            what = f"the validation value at step {run.step} is {value}"
            raise self.diverged(what)
        loss = sum(self.recent) / len(self.recent) if self.recent else math.nan
        self.recent.clear()
        run.note(self.module, loss, value)
        run.done = run.step >= plan.steps or run.stale >= plan.patience
        if self.checkpoint:
            self.save()

    def save(self) -> None:
        """Save the state, which must be one that training can go on from."""
        self.check_weights()
        assert self.checkpoint is not None
        own = {
            "optimizer": self.optimizer.state_dict(),
            "generator": self.generator.get_state(),
            "torch": generator_states(self.device),
            "recent": list(self.recent),
        }
        self.checkpoint.save(self.run.step, self.module.state_dict(), self.run.best, own | self.run.kept())

    def resume(self, saved: Saved) -> None:
        """Take up the state of a checkpoint."""
        with fitting(saved):
            put_weights(self.module, saved.weights)
            self.optimizer.load_state_dict(saved.state["optimizer"])
            self.generator.set_state(saved.state["generator"])
            set_generator_states(saved.state["torch"], self.device)
            self.recent += map(float, saved.state["recent"])
            self.run = RunState.of(saved)

    def check_weights(self) -> None:
        """Refuse weights that are not finite, as a derivative that was not has left them."""
        name = first_not_finite(self.module)
        if name is not None:
            what = f"{name} is not finite after {self.run.step} steps"
            raise self.diverged(what)

    def diverged(self, what: str) -> DataError:
        """Return the error, which says what is kept."""
        kept = f"; the weights of step {self.run.best_step}, the best, are kept" if self.run.best else ""
        return DataError(f"training diverged: {what}{kept}")


def _set_gradients(parameters: Sequence[nn.Parameter], losses: Sequence[Tensor], *, surgery: bool) -> float:
    """Put the gradient of the losses into the parameters, the mean over all processes; returns their sum."""
    total = torch.stack(list(losses)).sum()
    if not (surgery and len(losses) > 1):
        for parameter in parameters:
            parameter.grad = None
        total.backward()
        loss = total.detach()
        distributed.average([loss, *(parameter.grad for parameter in parameters if parameter.grad is not None)])
        return float(loss)
    gradients = []
    for loss in losses:
        parts = torch.autograd.grad(loss, parameters, retain_graph=True, materialize_grads=True)
        gradients.append(torch.cat([part.reshape(-1) for part in parts]))
    value = total.detach()
    distributed.average([value, *gradients])
    merged = project_conflicts(gradients)
    for parameter in parameters:
        count = parameter.numel()
        parameter.grad, merged = merged[:count].reshape(parameter.shape).clone(), merged[count:]
    return float(value)
