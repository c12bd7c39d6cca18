"""Which of several methods is better, how sure that is, and which cannot be told apart.

Sets of flights are what is sampled: everything is paired by set, on logarithms of standard deviations, in which methods
differ by factors. Means have Student's t intervals: at twelve sets they cover what they say, where percentiles and
accelerated bootstraps do not. All pairs of one table that may be ranked are one family, whose p values are Holm's
(Scandinavian Journal of Statistics 6, 65-70, 1979).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy import stats

COVERED = 0.95
ALPHA = 0.05

TIE_RATIO, TIE_NT = 1.10, 0.001
"""Two methods tie whose errors differ by no more than 10 percent or 1 pT, however sure that difference is."""

FEWEST = 4
"""Sets below which no difference is called sure: three pairs of one sign have a chance of 1 in 4."""


class Interval(NamedTuple):
    """A value and its 95 % interval; NaN where one set alone tells nothing."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Standing:
    """Where a method stands in one table.

    Attributes
    ----------
    method : str
    sets : int
        In which it has a score.
    ir : Interval
        Improvement ratio against truth, geometric mean over sets.
    excess_pt : Interval [pT]
        Error beyond the instrument's own: the median over sets, with the interval of its order statistics.
    over_baseline, over_leader : Interval
        Its improvement ratio over that of the baseline and of the leader, by set.
    p_baseline, p_leader : float
        Holm's; NaN where there are too few sets, or no such method.
    rank, rank_low, rank_high : int
        By geometric mean, of one that has not been in all sets by its ratio to the baseline; 1 and more than are surely
        better, and all but those that are surely worse. 0 for a method that has no rank.
    ties_leader : bool
    failed : tuple of str
        Gates that it has not passed: it has no rank.
    """

    method: str
    sets: int
    ir: Interval
    excess_pt: Interval
    over_baseline: Interval
    over_leader: Interval
    p_baseline: float
    p_leader: float
    rank: int
    rank_low: int
    rank_high: int
    ties_leader: bool
    failed: tuple[str, ...]


def geometric_mean(values: np.ndarray) -> Interval:
    """Return the geometric mean of positive values with the t interval of their logarithms; NaN are left out."""
    logs = np.log(values[np.isfinite(values)])
    if not len(logs):
        return Interval(np.nan, np.nan, np.nan)
    middle = float(logs.mean())
    if len(logs) < 2:
        return Interval(float(np.exp(middle)), np.nan, np.nan)
    half = float(stats.t.ppf(0.5 + COVERED / 2.0, len(logs) - 1) * logs.std(ddof=1) / np.sqrt(len(logs)))
    return Interval(*(float(np.exp(middle + step)) for step in (0.0, -half, half)))


def median(values: np.ndarray) -> Interval:
    """Return the median with the interval between two order statistics that covers it in 95 % of samples or more.

    It needs no distribution, and values may be zero: the number of values below the median is binomial. Below six
    values no such interval exists, and that from least to largest is given.
    """
    known = np.sort(values[np.isfinite(values)])
    if not len(known):
        return Interval(np.nan, np.nan, np.nan)
    # as many values are left out at each end as keep the chance of missing the median at 5 percent
    place = max(int(stats.binom.ppf((1.0 - COVERED) / 2.0, len(known), 0.5)) - 1, 0)
    return Interval(float(np.median(known)), float(known[place]), float(known[len(known) - 1 - place]))


def holm(p_values: Sequence[float]) -> np.ndarray:
    """Return p values that keep the chance of any false call in the family: Holm's steps down."""
    raw = np.asarray(p_values, dtype=float)
    order = np.argsort(raw, kind="stable")
    stepped = np.maximum.accumulate((len(raw) - np.arange(len(raw))) * raw[order])
    out = np.empty(len(raw))
    out[order] = np.minimum(stepped, 1.0)
    return out


def paired_p(first: np.ndarray, second: np.ndarray) -> float:
    """Return the p value of a paired t test on logarithms; 1 where all differences are zero, NaN with too few sets."""
    both = np.isfinite(first) & np.isfinite(second)
    if both.sum() < FEWEST:
        return float("nan")
    differences = np.log(first[both]) - np.log(second[both])
    if not differences.any():
        return 1.0
    if np.ptp(differences) < 1e-9 * np.abs(differences).max():
        return 0.0  # the same factor in every set
    return float(stats.ttest_1samp(differences, 0.0).pvalue)


def standings(
    std_nt: Mapping[str, np.ndarray],
    raw_nt: np.ndarray,
    floor_nt: np.ndarray,
    *,
    baseline: str,
    failed: Mapping[str, tuple[str, ...]] | None = None,
) -> list[Standing]:
    """Rank methods on one table.

    Parameters
    ----------
    std_nt : mapping of str to (sets,) [nT]
        STD of each method's error in band, by set; NaN where it has none.
    raw_nt, floor_nt : (sets,) [nT]
        Of the interference, and of the instrument's own error.
    baseline : str
        The method that all are compared with.
    failed : mapping, optional
        Gates that a method has not passed: it is listed last, without a rank, and leads nothing.

    Returns
    -------
    list of Standing
        The best first; then those without a rank.
    """
    failed = failed or {}
    mean = {name: _mean(values, std_nt.get(baseline)) for name, values in std_nt.items()}
    known = [name for name in std_nt if np.isfinite(mean[name])]
    order = sorted(known, key=lambda name: (mean[name], name))
    ranked = [name for name in order if not failed.get(name)]
    leader = ranked[0] if ranked else None
    # what has no rank is compared with the two that others are compared with, and no more
    pairs = [pair for pair in combinations(order, 2) if set(pair) <= set(ranked) or {baseline, leader} & set(pair)]
    raw = np.array([paired_p(std_nt[a], std_nt[b]) for a, b in pairs])
    sure = ~np.isnan(raw)
    adjusted = np.full(len(raw), np.nan)
    adjusted[sure] = holm(raw[sure])
    p = dict(zip(pairs, adjusted, strict=True))

    def better(a: str, b: str) -> bool:
        """Whether a is surely better than b, by more than a tie."""
        value = p.get((a, b), np.nan)
        return bool(value < ALPHA) and not _close(mean[a], mean[b])

    def between(a: str, b: str) -> float:
        return float(p.get((a, b), p.get((b, a), np.nan)))

    out = []
    for name in [*ranked, *(name for name in order if name not in ranked)]:
        own, has = std_nt[name], name in ranked
        low = 1 + sum(better(other, name) for other in ranked)
        high = len(ranked) - sum(better(name, other) for other in ranked)
        out.append(
            Standing(
                name,
                int(np.isfinite(own).sum()),
                geometric_mean(raw_nt / own),
                median(1000.0 * np.sqrt(np.maximum(own**2 - floor_nt**2, 0.0))),
                geometric_mean(std_nt[baseline] / own) if baseline in std_nt else Interval(np.nan, np.nan, np.nan),
                geometric_mean(std_nt[leader] / own) if leader else Interval(np.nan, np.nan, np.nan),
                between(baseline, name),
                between(leader, name) if leader else np.nan,
                ranked.index(name) + 1 if has else 0,
                low if has else 0,
                high if has else 0,
                has and leader is not None and name != leader and not better(leader, name),
                failed.get(name, ()),
            )
        )
    return out


def _mean(own: np.ndarray, baseline: np.ndarray | None) -> float:
    """Return a geometric mean over all sets: by the ratio to the baseline of one that has not been in all of them."""
    if baseline is None or not np.isfinite(own * baseline).any():
        return geometric_mean(own).value
    return geometric_mean(own / baseline).value * geometric_mean(baseline).value


def _close(first: float, second: float) -> bool:
    small, large = sorted((first, second))
    return large <= small * TIE_RATIO or large - small <= TIE_NT


def power(spread: float, sets: int, ratio: float) -> float:
    """Return the chance that a paired t test at 5 % sees a factor between two methods.

    Parameters
    ----------
    spread : float
        Standard deviation of the logarithm of the ratio from set to set.
    sets : int
    ratio : float
        The factor.
    """
    shift, bound = np.sqrt(sets) * np.log(ratio) / spread, stats.t.ppf(1.0 - ALPHA / 2.0, sets - 1)
    return float(stats.nct.sf(bound, sets - 1, shift) + stats.nct.cdf(-bound, sets - 1, shift))


def sets_needed(spread: float, ratio: float, chance: float = 0.8) -> int:
    """Return the fewest sets that see a factor with a chance; 10 000 where more would be needed."""
    return next((sets for sets in range(2, 10_000) if power(spread, sets, ratio) >= chance), 10_000)
