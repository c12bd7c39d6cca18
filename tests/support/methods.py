"""Small methods for the tests of the benchmark."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from magsim.compensation import Compensator
from magsim.recording import Recording


class Stub(Compensator):
    """A method made of one function of the recording; remembers what it was given.

    ``warmup`` is the declared warm-up [s]. All copies of one stub share its ``seen`` and ``learned``.
    """

    name = "stub"
    requires = ("mag_{sensor}_nt",)

    def __init__(self, *, function: Any = None, warmup: float = 0.0, seen: Any = None, learned: Any = None) -> None:
        self.function = function
        self.warmup = warmup
        self.seen = [] if seen is None else seen
        self.learned = [] if learned is None else learned

    @property
    def warmup_s(self) -> float:
        return self.warmup

    def learn(self, training, context):
        self.learned.append((training, context))

    def estimate(self, recording):
        self.seen.append(recording)
        return self.function(recording)


def zeros(recording: Recording) -> np.ndarray:
    return np.zeros(len(recording))


def stub(function: Callable[[Recording], np.ndarray] = zeros, warmup: float = 0.0) -> Stub:
    return Stub(function=function, warmup=warmup)


def without(recording: Recording, *stems: str) -> Recording:
    """The recording without the columns whose names begin in some way."""
    return replace(recording, data={k: v for k, v in recording.data.items() if not k.startswith(stems)})


def with_dropouts(recording: Recording, *spans: slice) -> Recording:
    """The recording with rows that its column of dropouts marks; reading and labels there are nonsense."""
    valid = np.ones(len(recording))
    for span in spans:
        valid[span] = 0.0
    wrong = {name: np.where(valid == 1.0, recording[name], 0.0) for name in ("mag_cabin_nt", "interference_cabin_nt")}
    return replace(recording, data={**recording.data, **wrong, "mag_cabin_valid": valid})
