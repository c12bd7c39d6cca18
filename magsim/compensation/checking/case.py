"""What the checks of a method share: recordings, fits, and changes of recordings."""

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NoReturn

import numpy as np
from threadpoolctl import ThreadpoolController

from magsim import columns
from magsim.compensation.base import Compensator, FitContext
from magsim.dataset import training_rows
from magsim.recording import Recording
from magsim.signals import spans
from magsim.streams import stream

SAME_NT = 1e-6
"""Two estimates that should be equal may differ by this: sums of other lengths round differently."""


class Skip(Exception):
    """A check does not apply; its text says why."""


class Failure(Exception):
    """A check failed; its text says what was seen."""


def fail(text: str) -> NoReturn:
    """End a check that failed."""
    raise Failure(text)


def skip(text: str) -> NoReturn:
    """End a check that does not apply."""
    raise Skip(text)


@dataclass
class Case:
    """A method with what it is checked on.

    Attributes
    ----------
    method : Compensator
        Parameters alone are taken from it.
    flights : tuple of Recording
        To learn from.
    probe : Recording
        What is estimated, with all that it holds.
    sensor : str
    seed : int
    held : tuple of str
        Digests of flights and probe before anything was done.
    """

    method: Compensator
    flights: tuple[Recording, ...]
    probe: Recording
    sensor: str
    seed: int
    held: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.held = tuple(shown(recording) for recording in (*self.flights, self.probe))

    def fit(self, flights: tuple[Recording, ...] | None = None) -> Compensator:
        """Return a new fit with the seed of the case."""
        training = training_rows(self.flights if flights is None else flights, self.sensor)
        return self.method.unfitted().fit_rows(training, FitContext(seed=self.seed))

    @cached_property
    def fitted(self) -> Compensator:
        """The method, fitted once."""
        return self.fit()

    @cached_property
    def estimate(self) -> np.ndarray:
        """Its estimate of the probe, (n,) [nT]."""
        return self.fitted.interference(self.probe)

    @property
    def mag(self) -> str:
        """Column of the magnetometer."""
        return columns.MAG.name(sensor=self.sensor)

    @property
    def reads_mag(self) -> bool:
        """Whether an estimate is given the reading."""
        return columns.MAG.pattern in self.method.requires

    @property
    def size_nt(self) -> float:
        """Deviation of the estimate."""
        known = self.estimate[np.isfinite(self.estimate)]
        return float(known.std()) if len(known) else 0.0

    def random(self, purpose: str) -> np.random.Generator:
        """Return random numbers for a check."""
        return stream(self.seed, f"check/{purpose}")


def off(one: np.ndarray, other: np.ndarray) -> float:
    """Return the largest difference of two estimates; infinite where one is NaN and the other is not."""
    if one.shape != other.shape or (np.isnan(one) != np.isnan(other)).any():
        return float("inf")
    known = ~np.isnan(one)
    return float(np.abs(one - other)[known].max(initial=0.0))


def expect_same(one: np.ndarray, other: np.ndarray, what: str, within_nt: float = 0.0) -> None:
    """Fail where two estimates differ."""
    apart = off(one, other)
    if apart > within_nt:
        seen = "in where they are NaN" if apart == float("inf") else f"by {apart:.3g} nT"
        fail(f"{what} differ {seen}")


def changed(recording: Recording, change: Callable[[str, np.ndarray], np.ndarray]) -> Recording:
    """Return a recording with changed columns."""
    return replace(recording, data={name: change(name, values) for name, values in recording.data.items()})


def is_read(method: Compensator, name: str) -> bool:
    """Return whether a column is of a family that the method's estimate reads."""
    return columns.family_of(name).pattern in method.requires


def shown(recording: Recording) -> str:
    """Return a digest of all that a recording holds."""
    digest = hashlib.sha256(recording.time_s.tobytes())
    for name, values in recording.data.items():
        digest.update(name.encode() + values.tobytes())
    digest.update(json.dumps(recording.meta, sort_keys=True, default=repr).encode())
    return digest.hexdigest()


def warming(recording: Recording, warmup_s: float) -> np.ndarray:
    """Mark the rows in the declared warm-up of each piece, (n,) bool."""
    out = np.zeros(len(recording), dtype=bool)
    for span in spans(recording.time_s):
        time_s = recording.time_s[span]
        out[span] = time_s - time_s[0] < warmup_s - 1e-9
    return out


@contextmanager
def blas_threads(count: int) -> Iterator[None]:
    """Run the block with so many BLAS threads.

    Raises
    ------
    Skip
        If there is no BLAS whose threads can be set.
    """
    controller = ThreadpoolController()
    with controller.limit(limits=count, user_api="blas"):
        pools = [pool for pool in ThreadpoolController().lib_controllers if pool.user_api == "blas"]
        if not pools or any(pool.num_threads != count for pool in pools):
            skip(f"the BLAS here does not run on {count} threads")
        yield
