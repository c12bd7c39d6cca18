"""Checks that a method leaves signal alone: offsets and anomalies of random shape come through."""

import math
from dataclasses import replace

import numpy as np

from magsim import columns
from magsim.compensation.checking.case import Case, changed, expect_same, fail
from magsim.recording import Recording
from magsim.signals import in_band

OFFSET_NT = 100.0

MOST_OFF = 0.05
"""Largest deviation of a gain from 1, as in the benchmark."""

DRAWS = 6
"""Random sets of anomalies."""


def offset(case: Case) -> str:
    """Check that a constant on the reading stays in the compensated reading."""
    shifted = changed(case.probe, lambda n, v: v + OFFSET_NT if n == case.mag else v)
    got = case.fitted.interference(shifted)
    if not case.reads_mag:
        expect_same(case.estimate, got, f"estimates with and without {OFFSET_NT:g} nT on the reading")
        return "the estimate does not depend on the reading"
    share = float(np.nanmean(got - case.estimate)) / OFFSET_NT
    if abs(share) > MOST_OFF:
        fail(f"of {OFFSET_NT:g} nT on the reading it takes {100.0 * share:.1f} % for interference")
    return f"of {OFFSET_NT:g} nT on the reading it takes {100.0 * share:.2g} % for interference"


def anomalies(case: Case) -> str:
    """Check that anomalies of random shape come through, in the reading alone and in the fluxgate with it."""
    gains = []
    for number in range(DRAWS):
        shape = anomaly(case.probe.time_s, case.random(f"anomaly/{number}"))
        for flown in (_in_reading(case, shape), _in_field(case, shape)):
            left = shape - (case.fitted.interference(flown) - case.estimate)
            known = np.isfinite(left)
            inside = [in_band(v[known], case.probe.time_s[known]) for v in (left, shape)]
            gains.append(float(inside[0] @ inside[1] / (inside[1] @ inside[1])))
            gains.append(float(left[known] @ shape[known] / (shape[known] @ shape[known])))
    low, high = min(gains), max(gains)
    if not (low >= 1.0 - MOST_OFF and high <= 1.0 + MOST_OFF):
        fail(
            f"anomalies of random shape come through by {low:.3f} to {high:.3f}; allowed: {1.0 - MOST_OFF:g} to "
            f"{1.0 + MOST_OFF:g}"
        )
    return f"{DRAWS} sets of anomalies of random shape come through by {low:.4f} to {high:.4f}"


def anomaly(time_s: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return anomalies of random shape along a flight, (n,) [nT].

    Bumps, the dipole's swing to both sides, and edges, at random times, 0.7 to 15 s wide and 1 to 100 nT high.
    """
    out = np.zeros(len(time_s))
    for kind in random.permutation(np.arange(9) % 3):
        width = 0.7 * (15.0 / 0.7) ** random.random()
        height = random.choice((-1.0, 1.0)) * 100.0 ** random.random()
        x = (time_s - random.uniform(time_s[0], time_s[-1])) / width
        bump = np.exp(-0.5 * x**2)
        out += height * (bump, math.exp(0.5) * x * bump, 1.0 / (1.0 + np.exp(-np.clip(4.0 * x, -50.0, 50.0))))[kind]
    return out


def _in_reading(case: Case, shape: np.ndarray) -> Recording:
    return changed(case.probe, lambda n, v: v + shape if n == case.mag else v)


def _in_field(case: Case, shape: np.ndarray) -> Recording:
    """Return the probe over the anomaly: every magnetometer reads it, fluxgates along the field."""
    data = dict(case.probe.data)
    for sensor in case.probe.scalars:
        name = columns.MAG.name(sensor=sensor)
        data[name] = data[name] + shape
    for sensor in case.probe.fluxgates:
        vector = case.probe.vector(columns.FLUX, sensor=sensor)
        longer = vector * (1.0 + shape / np.linalg.norm(vector, axis=1))[:, None]
        data |= {columns.FLUX.name(sensor=sensor, axis=a): longer[:, i] for i, a in enumerate(columns.AXES)}
    return replace(case.probe, data=data)
