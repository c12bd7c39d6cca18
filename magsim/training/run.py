"""A training run, whatever the optimizer: its progress, its outcome, and what a checkpoint keeps of it."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from torch import Tensor, nn

from magsim.errors import DataError
from magsim.training.checkpoint import Saved


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
        Estimated time to the last step; NaN before the first that this process makes.
    spent_s : float [s]
        Time spent, that before a break included.
    learning_rate : float
        Of the next step; NaN for optimizers that have none.
    """

    phase: str
    step: int
    steps: int
    loss: float
    valid: float
    best: float
    eta_s: float
    spent_s: float
    learning_rate: float


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
class RunState:
    """State of a run, the part that does not depend on the optimizer.

    ``spent_s`` is the time [s] that processes before this one have spent.
    """

    step: int = 0
    best_step: int = 0
    best_value: float = math.inf
    best: dict[str, Tensor] = field(default_factory=dict)
    history: list[tuple[int, float, float]] = field(default_factory=list)
    done: bool = False
    spent_s: float = 0.0

    def __post_init__(self) -> None:
        self._first, self._started = self.step, time.monotonic()

    def note(self, module: nn.Module, loss: float, value: float) -> None:
        """Take in a validation, and the module's state if it is the best."""
        self.history.append((self.step, loss, value))
        if value < self.best_value:
            best = {name: tensor.detach().clone() for name, tensor in module.state_dict().items()}
            self.best_step, self.best_value, self.best = self.step, value, best

    @property
    def stale(self) -> int:
        """Validations since the best."""
        return sum(step > self.best_step for step, _, _ in self.history)

    def outcome(self) -> Outcome:
        """Return what the run came to."""
        return Outcome(self.best_step, self.best_value, self.step, tuple(self.history))

    def progress(self, phase: str, steps: int, *, learning_rate: float = math.nan) -> Progress:
        """Return where the run stood at its last validation."""
        step, loss, value = self.history[-1]
        here_s, made = time.monotonic() - self._started, self.step - self._first
        rest_s = here_s / made * (steps - self.step) if made else math.nan
        eta_s = 0.0 if self.done else rest_s
        spent_s = self.spent_s + here_s
        return Progress(phase, step, steps, loss, value, self.best_value, eta_s, spent_s, learning_rate)

    def kept(self) -> dict[str, Any]:
        """Return what a checkpoint keeps beside the weights."""
        return {
            "best_step": self.best_step,
            "best_value": self.best_value,
            "history": [list(row) for row in self.history],
            "done": self.done,
            "spent_s": self.spent_s + time.monotonic() - self._started,
        }

    @classmethod
    def of(cls, saved: Saved) -> "RunState":
        """Return the run that a checkpoint holds; call it inside of ``fitting``."""
        state = saved.state
        history = [(int(step), float(loss), float(value)) for step, loss, value in state["history"]]
        best_step, best_value = int(state["best_step"]), float(state["best_value"])
        done, spent_s = bool(state["done"]), float(state["spent_s"])
        return cls(saved.step, best_step, best_value, saved.best, history, done, spent_s)


@contextmanager
def fitting(saved: Saved) -> Iterator[None]:
    """Refuse a checkpoint whose parts do not fit what takes them inside the block.

    Raises
    ------
    DataError
    """
    try:
        yield
    except (RuntimeError, KeyError, ValueError, TypeError, IndexError, AttributeError) as error:
        reason = f"{error} is missing" if isinstance(error, KeyError) else (str(error) or "?").splitlines()[0]
        msg = f"checkpoint {saved.path} cannot be taken up: {reason}"
        raise DataError(msg) from None
