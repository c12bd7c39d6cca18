"""Drift and lag of instruments, against their recursions and differential equations."""

import numpy as np
import pytest

from magsim import signals


def test_gauss_markov_is_its_recursion_with_the_same_draws():
    """x_k = a x_(k-1) + sigma sqrt(1 - a^2) w_k with a = exp(-step / correlation), begun with sigma w_0."""
    got = signals.gauss_markov(np.random.default_rng(5), (50, 2), 3.0, 4.0, 10.0)
    draws = np.random.default_rng(5).standard_normal((50, 2))
    keep = np.exp(-0.1 / 4.0)
    expected = np.empty((50, 2))
    expected[0] = 3.0 * draws[0]
    for k in range(1, 50):
        expected[k] = keep * expected[k - 1] + 3.0 * np.sqrt(1.0 - keep**2) * draws[k]
    np.testing.assert_allclose(got, expected, rtol=1e-12)


def test_gauss_markov_is_stationary_with_the_stated_correlation():
    """Over 40,000 short runs: the standard error of a variance is sigma^2 sqrt(2 / n) = 0.7 %."""
    x = signals.gauss_markov(np.random.default_rng(0), (30, 40_000), 2.0, 1.5, 10.0)
    np.testing.assert_allclose(x.var(axis=1), 4.0, rtol=0.03)
    for lag in (5, 15, 29):
        assert np.mean(x[0] * x[lag]) == pytest.approx(4.0 * np.exp(-lag / 15.0), abs=0.1)


def test_a_lag_of_a_ramp_is_the_solution_of_its_equation():
    """T y' = x - y with x = a + b t, at rest before: y = a + b (t - T) + b T exp(-t / T)."""
    t = np.arange(100) / 20.0
    got = signals.first_order_lag(5.0 + 3.0 * t, 0.7, 20.0)
    np.testing.assert_allclose(got, 5.0 + 3.0 * (t - 0.7) + 3.0 * 0.7 * np.exp(-t / 0.7), rtol=0, atol=1e-12)


def test_a_lag_is_exact_for_straight_lines_between_samples():
    """Against the integral of exp(-(t - s) / T) x(s) / T on a grid that is 2000 times finer."""
    rate_hz, tau = 10.0, 0.25
    x = np.random.default_rng(1).normal(size=(12, 2))
    t = np.arange(12) / rate_hz
    fine = np.linspace(0.0, t[-1], 22_001)
    got = signals.first_order_lag(x, tau, rate_hz)
    for column in range(2):
        inside = np.interp(fine, t, x[:, column])
        for k in (1, 5, 11):
            weight = np.exp(-(t[k] - fine) / tau) / tau
            until = fine <= t[k] + 1e-12
            value = np.exp(-t[k] / tau) * x[0, column] + np.trapezoid((weight * inside)[until], fine[until])
            assert got[k, column] == pytest.approx(value, abs=1e-6)
    np.testing.assert_array_equal(got[0], x[0])


def test_without_a_time_constant_nothing_changes():
    x = np.random.default_rng(2).normal(size=20)
    np.testing.assert_array_equal(signals.first_order_lag(x, 0.0, 10.0), x)
