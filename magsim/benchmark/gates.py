"""Gates: what a method must not do to win, however small its error is.

Gain and distortion are held on each set: what is taken on one is not made up for on another. The slow error, which
differs from set to set, is held by its median.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from magsim.benchmark.twins import PEAKS_NT

GAIN, ADAPTIVE_GAIN = 0.02, 0.05
"""How far from 1 the gain of anomalies may be: of methods that are fitted beforehand, and of those that declare that
they adapt."""

DISTORTION = 0.1

SLOW_NT, SLOW_RATIO = 1.0, 1.5
"""Largest slow error: 1 nT, or so many times that of the baseline, whichever is larger."""

Scores = Mapping[str, float]
"""Of one set, by metric."""


def gate_failures(sets: Sequence[Scores], baseline: Sequence[Scores], *, adaptive: bool = False) -> tuple[str, ...]:
    """Return which gates a method does not pass, in words; none if it passes.

    Parameters
    ----------
    sets : sequence of mapping
        Scores of the method, set by set.
    baseline : sequence of mapping
        Those of the baseline on the same sets; empty without one.
    adaptive : bool
        The method declares that it learns while it estimates.
    """
    allowed, out = ADAPTIVE_GAIN if adaptive else GAIN, []
    for peak in PEAKS_NT:
        gains = _known(sets, f"gain_{peak:g}")
        worst = max(gains, key=lambda gain: abs(gain - 1.0), default=1.0)
        if abs(worst - 1.0) >= allowed:
            out.append(f"gain {round(worst, 3) + 0.0:.3f} at {peak:g} nT")
    if max(_known(sets, "distortion"), default=0.0) >= DISTORTION:
        out.append(f"distortion {max(_known(sets, 'distortion')):.2g}")
    slow, of_baseline = _known(sets, "slow_nt"), _known(baseline, "slow_nt")
    if slow:
        limit = max(SLOW_NT, SLOW_RATIO * float(np.median(of_baseline)) if of_baseline else SLOW_NT)
        if float(np.median(slow)) > limit:
            out.append(f"slow error {np.median(slow):.3g} nT, allowed {limit:.3g}")
    return tuple(out)


def _known(sets: Sequence[Scores], metric: str) -> list[float]:
    return [one[metric] for one in sets if not np.isnan(one.get(metric, np.nan))]
