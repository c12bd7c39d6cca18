"""Levenberg-Marquardt: training of small networks by damped normal equations, in float64.

Far closer to a minimum than Adam comes, where the parameters are few: the cost of a step grows with their square. The
algorithm is that of Hagan and Menhaj, Training Feedforward Networks with the Marquardt Algorithm, IEEE Transactions on
Neural Networks 5(6), 1994, with the stops of MATLAB's ``trainlm``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from magsim.errors import DataError, RequestError
from magsim.threads import one_blas_thread
from magsim.training import distributed
from magsim.training.checkpoint import Checkpoint, Saved
from magsim.training.determinism import reproducible
from magsim.training.least_squares import Normal, SquaredErrors
from magsim.training.run import Outcome, Progress, RunState, fitting
from magsim.training.weights import put_weights

MOST_PARAMETERS = 5000
"""Of networks that are taken: the normal equations of 5000 take 200 MB, and a step on 12 000 rows many seconds."""

FACTOR = 10.0
"""By which the damping falls after a step that lowers the sum of squares, and rises after one that does not."""


@dataclass(frozen=True)
class LevenbergPlan:
    """How long to train, and how the steps are damped.

    The numbers of the damping are those of MATLAB's ``trainlm``, from memory (an estimate). They belong to sums over
    all rows, with inputs and targets that are standardized.

    Attributes
    ----------
    steps : int
        Most steps; each lowers the sum of squares of all rows.
    every : int
        Steps between validations.
    patience : int
        Validations without a better value after which to stop.
    damping, least_damping, most_damping : float
        What is added to the diagonal of J^T J: at first, at least, and where training ends because no step lowers the
        sum of squares.
    least_gradient : float
        Length of J^T e below which training ends.
    goal : float
        Mean squared error below which training ends.
    weight_decay : float
        Weight of the squared parameters, beside the mean squared error.
    threads : int
        CPU threads of torch for outputs and Jacobians; the normal equations are formed on one.
    """

    steps: int
    every: int = 1
    patience: int = 10
    damping: float = 1e-3
    least_damping: float = 1e-12
    most_damping: float = 1e10
    least_gradient: float = 1e-7
    goal: float = 0.0
    weight_decay: float = 0.0
    threads: int = 1


def train_levenberg(
    module: nn.Module,
    inputs: Tensor,
    targets: Tensor,
    measure: Callable[[nn.Module], float],
    plan: LevenbergPlan,
    *,
    weights: Tensor | None = None,
    operator: Tensor | None = None,
    phase: str = "train",
    progress: Callable[[Progress], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Outcome:
    """Train a module and leave it in its best state, in evaluation mode.

    All numbers are float64 while it trains; validations and the best state are those of the module in the precision
    it came in. Nothing is random.

    Parameters
    ----------
    module : nn.Module
        With its start weights; maps windows (b, c, t) to (b, o). Parameters that need no gradient stay as they are.
    inputs : (n, c, t)
        Windows, or samples with t = 1.
    targets : (n, o)
    measure : callable
        Validation value of the module, to be made small; called at step 0, every ``plan.every`` steps and at the end.
    plan : LevenbergPlan
    weights : (n, o), optional
        Of the squared errors, not negative.
    operator : (k, g), optional
        Applied to each g consecutive errors, which are then k; such as a band-pass over g samples. Errors have their
        weights before, so that those of weight 0 count as none.
    phase : str
        Name of the run in the progress.
    progress : callable, optional
        Called at each validation, and with the last one that a run has made which is taken up; its loss is the mean
        squared error now.
    checkpoint : Checkpoint, optional
        Where the state is kept at each validation; a state found there is taken up, and the end is the same as
        without the break.

    Returns
    -------
    Outcome
        Fewer steps than planned where patience is at its end, or no step lowers the sum of squares.

    Raises
    ------
    RequestError
        If the module has more than 5000 parameters or none, another shape of outputs than the targets, or cannot be
        differentiated row by row.
    DataError
        If the loss, a derivative or the validation value is not finite; the module is left in the best state before.
    ValueError
        If shapes do not go together, or weights are negative, all zero or not finite.
    """
    count = sum(parameter.numel() for parameter in module.parameters() if parameter.requires_grad)
    if not 1 <= count <= MOST_PARAMETERS:
        msg = (
            f"Levenberg-Marquardt trains networks of 1 to {MOST_PARAMETERS} parameters; {type(module).__name__} has "
            f"{count}"
        )
        raise RequestError(msg)
    module.eval()
    with reproducible(plan.threads), one_blas_thread():
        squares = SquaredErrors(module, inputs, targets, weights=weights, operator=operator, decay=plan.weight_decay)
        loop = _Loop(module, squares, measure, plan, phase=phase, progress=progress, checkpoint=checkpoint)
        try:
            loop.go()
        finally:
            if loop.run.best:
                module.load_state_dict(loop.run.best)
    return loop.run.outcome()


class _Loop:
    """One run of ``train_levenberg``: its parts and its state."""

    def __init__(
        self,
        module: nn.Module,
        squares: SquaredErrors,
        measure: Callable[[nn.Module], float],
        plan: LevenbergPlan,
        *,
        phase: str,
        progress: Callable[[Progress], None] | None,
        checkpoint: Checkpoint | None,
    ) -> None:
        self.module, self.squares, self.measure, self.plan = module, squares, measure, plan
        self.phase, self.progress, self.checkpoint = phase, progress, checkpoint
        self.run, self.vector, self.damping = RunState(), squares.start, plan.damping
        saved = checkpoint.load() if checkpoint else None
        if saved:
            self.resume(saved)
        self.value = squares.value(self.vector)

    def go(self) -> None:
        """Train to the end."""
        run, plan = self.run, self.plan
        if not run.history:
            self.validate()
        else:
            self.report()
        while not run.done:
            moved = self.loss > plan.goal and self.step()
            if not moved or run.step % plan.every == 0 or run.step == plan.steps:
                self.validate(last=not moved)

    @property
    def loss(self) -> float:
        """Mean squared error now, with the part of the decay."""
        return self.value / self.squares.terms

    def step(self) -> bool:
        """Make one step that lowers the sum of squares; False where none does."""
        plan = self.plan
        normal = self.squares.normal(self.vector)
        if not bool(normal.matrix.isfinite().all() & normal.gradient.isfinite().all()):
            msg = f"training diverged: a derivative of the outputs at step {self.run.step} is not finite"
            raise DataError(msg)
        if float(torch.linalg.vector_norm(normal.gradient)) <= plan.least_gradient:
            return False
        while self.damping <= plan.most_damping:
            change = _solve(normal, self.damping)
            # a value that is not finite is not less, so such a step is damped further
            if change is not None and (value := self.squares.value(self.vector + change)) < self.value:
                self.vector, self.value = self.vector + change, value
                self.damping = max(self.damping / FACTOR, plan.least_damping)
                self.run.step += 1
                return True
            self.damping *= FACTOR
        return False

    def validate(self, *, last: bool = False) -> None:
        """Measure the module, keep it if it is the best, save the state, report the progress."""
        run, plan = self.run, self.plan
        if not math.isfinite(self.loss):
            msg = f"training diverged: the loss at step {run.step} is {self.loss}"
            raise DataError(msg)
        if not run.history or run.history[-1][0] != run.step:
            self.squares.write(self.vector, self.module)
            with torch.no_grad():
                value = float(self.measure(self.module))
            if not math.isfinite(value):
                msg = f"training diverged: the validation value at step {run.step} is {value}"
                raise DataError(msg)
            run.note(self.module, self.loss, value)
        run.done = last or run.step >= plan.steps or run.stale >= plan.patience
        if self.checkpoint:
            own = {"parameters": self.vector, "damping": self.damping}
            self.checkpoint.save(run.step, self.module.state_dict(), run.best, own | run.kept())
        self.report()

    def report(self) -> None:
        """Tell where the run stands."""
        if self.progress and distributed.rank() == 0:
            self.progress(self.run.progress(self.phase, self.plan.steps))

    def resume(self, saved: Saved) -> None:
        """Take up the state of a checkpoint."""
        with fitting(saved):
            put_weights(self.module, saved.weights)
            vector = saved.state["parameters"].to(self.vector)
            self.vector = vector.reshape(self.vector.shape)
            self.damping = float(saved.state["damping"])
            self.run = RunState.of(saved)


def _solve(normal: Normal, damping: float) -> Tensor | None:
    """Solve the damped normal equations by Cholesky; None where they are singular to rounding."""
    damped = normal.matrix.clone()
    damped.diagonal().add_(damping)
    # factors of one thread and of two differ in their last bits
    with reproducible(1):
        factor, failed = torch.linalg.cholesky_ex(damped)
        return None if bool(failed) else torch.cholesky_solve(normal.gradient[:, None], factor)[:, 0]
