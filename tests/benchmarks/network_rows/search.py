"""Random search of settings: trials with equal budgets, and which of them is best."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.benchmarks.network_rows.flights import WORLDS
from tests.benchmarks.network_rows.measuring import Case, Found
from tests.benchmarks.network_rows.spaces import trial

LEAST_OVER_STAGE = 0.97
"""A trial with less than that of its first stage in some world, median of the pairs, is not allowed to win."""


@dataclass(frozen=True)
class Trial:
    """Settings, and what they reach.

    Attributes
    ----------
    method : str
    number : int
        0 is the preset as it is.
    params : mapping
        Laid over it.
    ir : float
        Geometric mean of the improvement ratio over worlds and pairs; NaN where a fit failed.
    over_stage : float
        Over that of the first stage: the least of all worlds, each the median of its pairs.
    fit_s : float [s]
        Processor time of the longest fit.
    failed : str
        Why a fit failed; empty where none did.
    """

    method: str
    number: int
    params: Mapping[str, Any]
    ir: float = math.nan
    over_stage: float = math.nan
    fit_s: float = math.nan
    failed: str = ""

    @property
    def allowed(self) -> bool:
        """Whether it may win."""
        return not self.failed and self.over_stage >= LEAST_OVER_STAGE

    @property
    def settings(self) -> str:
        """Its settings in words."""
        return " ".join(f"{key}={value}" for key, value in self.params.items()) or "as it is"


def cases_of(method: str, number: int, seed: int, pairs: int) -> list[list[Case]]:
    """Return the fits of a trial, world by world."""
    params = trial(method, number, seed)
    return [[Case(method, world, pair, params=params) for pair in range(pairs)] for world in WORLDS]


def judged_trial(method: str, number: int, seed: int, results: Sequence[tuple[Case, Mapping[str, Any]]]) -> Trial:
    """Return a trial with what its fits have reached."""
    params = trial(method, number, seed)
    for _, found in results:
        if "failed" in found:
            return Trial(method, number, params, failed=found["failed"])
    scores = [(case.world, Found(**found["tests"]["test"])) for case, found in results]
    over = [
        statistics.median(one.over_stage for where, one in scores if where == world)
        for world in dict.fromkeys(where for where, _ in scores)
    ]
    ir = math.exp(statistics.fmean(math.log(one.ir) for _, one in scores))
    return Trial(method, number, params, ir, min(over), max(one.fit_s for _, one in scores))


def best_of(trials: Sequence[Trial]) -> Trial | None:
    """Return the trial of the highest improvement ratio of those that may win; None where none may."""
    return max((one for one in trials if one.allowed), key=lambda one: one.ir, default=None)
