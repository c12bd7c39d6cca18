"""Trains whose cycles scatter: a smooth command, peaks and times of each cycle, the stated scatter."""

import math
from itertools import pairwise

import numpy as np
import pytest

from magsim.flight.pilot.cycles import Cycle, TrainCurve, scattered
from magsim.scenario.maneuvers import FURTHEST

CYCLES = (Cycle(5.0, 6.0), Cycle(6.5, 5.1), Cycle(4.4, 6.9), Cycle(5.2, 6.0))


@pytest.fixture
def curve() -> TrainCurve:
    return TrainCurve(CYCLES, 3.0, 2.5)


def sampled(curve: TrainCurve, step_s: float = 1e-3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times from before the rise to after the fall, angle and rate there."""
    time = np.arange(-curve.ease_in_s - 0.5, curve.stop_s + curve.ease_out_s + 0.5, step_s)
    angle, rate = np.array([curve.at(t) for t in time.tolist()]).T
    return time, angle, rate


def test_even_cycles_are_a_sine() -> None:
    curve = TrainCurve((Cycle(5.0, 6.0),) * 3, 3.0, 3.0)
    assert curve.starts_s == pytest.approx((0.0, 6.0, 12.0, 18.0))
    for time in np.arange(0.0, 18.0, 0.37):
        angle, omega = 2.0 * math.pi * time / 6.0, 2.0 * math.pi / 6.0
        assert curve.at(time) == pytest.approx((5.0 * math.sin(angle), 5.0 * omega * math.cos(angle)))


def test_the_rate_is_the_derivative_and_nothing_steps(curve: TrainCurve) -> None:
    time, angle, rate = sampled(curve)
    np.testing.assert_allclose(np.gradient(angle, time)[1:-1], rate[1:-1], atol=1e-3)
    # No step of angle, rate or acceleration: each changes by its derivative times the time alone.
    turning = np.gradient(rate, time)
    largest = max(c.amplitude_deg * (2.0 * math.pi / c.period_s) ** 2 for c in CYCLES)
    assert np.abs(turning).max() < 1.3 * largest
    inside = (time[:-1] > 0.1) & (time[:-1] < curve.stop_s - 0.1)
    assert np.abs(np.diff(turning))[inside].max() < 4.0 * largest * 1e-3
    assert angle[0] == rate[0] == angle[-1] == rate[-1] == 0.0


def test_each_cycle_has_its_peaks_and_about_its_time(curve: TrainCurve) -> None:
    time, angle, _ = sampled(curve)
    assert curve.starts_s[-1] == pytest.approx(sum(cycle.period_s for cycle in CYCLES))
    for cycle, (start, stop) in zip(CYCLES, pairwise(curve.starts_s), strict=True):
        own = angle[(time >= start) & (time <= stop)]
        assert (own.max(), own.min()) == pytest.approx((cycle.amplitude_deg, -cycle.amplitude_deg), rel=1e-5)
        assert curve.at(start)[0] == pytest.approx(0.0, abs=1e-6)
        assert curve.at(start)[1] > 0.0
        # A cycle takes from its neighbors, or gives them, 5/128 of what its period differs from theirs.
        number = CYCLES.index(cycle)
        near = [CYCLES[i].period_s for i in (number - 1, number + 1) if 0 <= i < len(CYCLES)]
        taken = 5.0 / 128.0 * sum(period - cycle.period_s for period in near)
        assert stop - start == pytest.approx(cycle.period_s + taken, abs=1e-9)


@pytest.mark.parametrize("count", [2, 3, 8])
def test_scatter_is_as_stated_and_the_train_takes_its_time(count: int) -> None:
    rng = np.random.default_rng(5)
    trains = np.array([scattered(Cycle(4.0, 6.0), count, 0.15, 0.10, rng) for _ in range(4000)])
    amplitude, period = trains[..., 0] / 4.0 - 1.0, trains[..., 1] / 6.0 - 1.0
    assert abs(amplitude.mean()) < 0.01
    assert amplitude.std() == pytest.approx(0.15, rel=0.03)
    assert period.std() == pytest.approx(0.10, rel=0.06)
    np.testing.assert_allclose(period.sum(axis=1), 0.0, atol=1e-12)
    assert np.abs(amplitude).max() <= FURTHEST * 0.15
    assert np.abs(period).max() <= FURTHEST * 0.10
