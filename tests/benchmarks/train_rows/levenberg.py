"""An epoch of Levenberg-Marquardt beside a step of scipy's ``least_squares``, by CPU time on one thread.

The network is that of paper 004's sub-networks Z3 to Z5: three perceptrons with one hidden layer of tanh, 9-4, 15-7 and
24-12, 478 parameters, on 12 000 rows. Rows are three taps of 16 standardized columns, targets those of another network
of the same form, with noise. Both start from the same weights and use the same function for the Jacobian; a step lasts
from one Jacobian to the next. In each round the solvers take turns; the ratio is to scipy's faster one, and the figures
are medians over rounds.
"""

import statistics
import time
from collections.abc import Callable, Sequence

import numpy as np
import torch
from scipy.optimize import least_squares
from torch import Tensor, nn

from magsim.compensation.networks.modules.branches import AddedBranches, Branch
from magsim.threads import one_blas_thread
from magsim.training import LevenbergPlan, reproducible, seeded, train_levenberg
from magsim.training.least_squares import SquaredErrors
from tests.benchmarks.rows import Row, at_least, stated

ROWS, TAPS, ROUNDS, STEPS = 12_000, 3, 3, 6
BRANCHES = {
    "Z3": Branch(tuple(range(3)), 4),
    "Z4": Branch(tuple(range(3, 8)), 7),
    "Z5": Branch(tuple(range(8, 16)), 12),
}


def network(seed: int) -> nn.Module:
    """Sub-networks with random weights."""
    with seeded(seed):
        return AddedBranches(BRANCHES, TAPS).double()


def problem() -> tuple[Tensor, Tensor]:
    """Inputs (n, 16, 3) and targets (n, 1)."""
    generator = torch.Generator().manual_seed(0)
    inputs = torch.randn(ROWS + TAPS - 1, 16, generator=generator, dtype=torch.float64).unfold(0, TAPS, 1)
    with torch.no_grad():
        targets = network(1)(inputs)
    return inputs, targets + 0.1 * torch.randn(targets.shape, generator=generator, dtype=torch.float64)


def median_step_s(marks: Sequence[float]) -> float:
    """Median time from mark to mark [s]."""
    return float(np.median(np.diff(marks)))


def ours_s(inputs: Tensor, targets: Tensor) -> float:
    """CPU time of an epoch, from validation to validation [s]."""
    marks: list[float] = []

    def measure(_: nn.Module) -> float:
        marks.append(time.process_time())
        return -float(len(marks))

    train_levenberg(network(0), inputs, targets, measure, LevenbergPlan(STEPS))
    return median_step_s(marks)


def scipy_s(inputs: Tensor, targets: Tensor, method: str) -> float:
    """CPU time of a step, from Jacobian to Jacobian [s]."""
    squares, own, marks = SquaredErrors(network(0), inputs, targets), network(0), []

    def errors(weights: np.ndarray) -> np.ndarray:
        squares.write(torch.from_numpy(weights), own)
        with torch.no_grad():
            return (own(inputs) - targets).numpy()[:, 0]

    def jacobian(weights: np.ndarray) -> np.ndarray:
        marks.append(time.process_time())
        vector = torch.from_numpy(weights)
        return torch.cat([squares.jacobian(vector, part)[1] for part in inputs.split(4096)]).flatten(0, 1).numpy()

    exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    least_squares(errors, squares.start.numpy(), jacobian, method=method, max_nfev=STEPS, **exact)
    return median_step_s(marks)


def rows() -> list[Row]:
    """Figures of both."""
    inputs, targets = problem()
    solvers: dict[str, Callable[[], float]] = {
        "lm_epoch": lambda: ours_s(inputs, targets),
        "scipy_trf_step": lambda: scipy_s(inputs, targets, "trf"),
        "scipy_lm_step": lambda: scipy_s(inputs, targets, "lm"),
    }
    with reproducible(1), one_blas_thread():
        rounds = [{name: solver() for name, solver in solvers.items()} for _ in range(ROUNDS)]
    ratios = [min(found["scipy_trf_step"], found["scipy_lm_step"]) / found["lm_epoch"] for found in rounds]
    figures = [stated(f"{name}_ms", 1e3 * statistics.median(found[name] for found in rounds), "ms") for name in solvers]
    return [*figures, at_least("lm_epoch_over_scipy", statistics.median(ratios), "1", 3.0)]
