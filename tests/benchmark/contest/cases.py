"""Flights, methods in files, and contests of them, for the tests beside."""

import textwrap
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from magsim.benchmark.contest import Allowance, Contest, Contestant, Finish
from magsim.recording import Recording
from tests.support.inertial import flown

SENSOR = "cabin"
LIMITS = Allowance(fit_s=60.0, estimate_s=60.0)

HEAD = """
import contextlib, gc, json, os, socket, sys, tempfile, time
from pathlib import Path
import numpy as np
from magsim.compensation import Compensator

class Method(Compensator):
    name = "method"
    requires = ("flux_{sensor}_{axis}_nt",)
    warmup_s = WARMUP

    def learn(self, training, context):
        LEARN

    def estimate(self, recording):
        ESTIMATE
"""


@cache
def training() -> tuple[Recording, ...]:
    """Two labeled flights."""
    return tuple(_flight(seed, slice(0, 5000)).labeled() for seed in (0, 1))


@cache
def flights() -> tuple[Recording, ...]:
    """Two flights of different lengths, with truth."""
    return tuple(_flight(2, rows) for rows in (slice(5000, 8000), slice(8000, 10_000)))


def _flight(seed: int, rows: slice) -> Recording:
    """Return a part of a flight, whose times are the nearest numbers to whole tenths, as those of a contest are."""
    whole = flown(seed=seed)
    return replace(whole, time_s=np.round(whole.time_s, 6)).take(rows)


def rounds() -> list[list[Recording]]:
    """The flights, twice."""
    return [[flight.blind() for flight in flights()] for _ in range(2)]


def method_file(
    folder: Path,
    estimate: str = "return np.zeros(len(recording))",
    *,
    learn: str = "pass",
    warmup: str = "0.0",
    end: str = "",
) -> str:
    """Write a method whose two functions have given bodies; return what an entry calls it."""

    def inside(body: str) -> str:
        return textwrap.indent(textwrap.dedent(body), 8 * " ").strip()

    text = HEAD.replace("WARMUP", warmup).replace("LEARN", inside(learn)).replace("ESTIMATE", inside(estimate))
    path = folder / "own_method.py"
    path.write_text(text + textwrap.dedent(end), encoding="utf-8")
    return f"{path}:Method"


def judged(contest: Contest, method: str, *, seed: int = 1, limits: Allowance = LIMITS) -> Finish:
    """Let a method fit and estimate."""
    return contest.run(Contestant("a", method), training(), SENSOR, rounds(), limits, np.random.default_rng(seed))
