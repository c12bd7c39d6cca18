"""The equations of the exact norm against closed forms, numerical derivatives and scipy's own least squares."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from magsim.compensation.exact_norm.estimation import (
    DAY_NT,
    LATER_S,
    Estimation,
    FlightRows,
    exact_interference,
    jacobian_of,
    shares_of,
)
from magsim.compensation.exact_norm.sources import UNSHAPED, Driven, Signal
from magsim.compensation.reduction import Reduction

RNG = np.random.default_rng(5)
TIME_S = np.arange(3000) / 10.0
TABLE = (
    Signal("permanent", "permanent", "nT", 1000.0),
    *(Signal(f"induced {axis}", "induced", "1", 0.01) for axis in "xyz"),
)
TRUTH = np.array([[-60.0, 45.0, 90.0], [0.009, -0.0008, 0.0019], [-0.0015, -0.006, 0.0009], [0.0025, 0.0012, 0.005]])


def turning(phase: float = 0.0) -> Driven:
    """A field of 45 000 nT in the axes of a body that swings about all of them."""
    angles = [
        np.radians(a) * np.sin(2.0 * np.pi * f * TIME_S + phase + a)
        for a, f in ((9.0, 0.11), (7.0, 0.17), (14.0, 0.23))
    ]
    course = np.floor(TIME_S / 75.0) * np.pi / 2.0 + angles[0]
    field = np.column_stack([30e3 * np.cos(course), -30e3 * np.sin(course), np.full(len(TIME_S), 33e3)])
    field[:, 2] += 30e3 * angles[1]
    field[:, 1] += 33e3 * angles[2]
    field *= 45e3 / np.linalg.norm(field, axis=1)[:, None]
    return unbent(field, np.column_stack([np.ones(len(field)), field]))


def unbent(field, signals) -> Driven:
    """Signals without a memory."""
    return Driven(field, signals, np.zeros((0, 3, len(field))))


def test_the_interference_is_the_difference_of_two_lengths():
    driven = turning()
    total = driven.background + driven.signals @ TRUTH
    expected = np.linalg.norm(total, axis=1) - np.linalg.norm(driven.background, axis=1)
    np.testing.assert_allclose(exact_interference(driven, TRUTH), expected, atol=1e-9)
    np.testing.assert_allclose(shares_of(driven, TRUTH).sum(axis=1), expected, atol=1e-9)


def test_the_jacobian_is_the_derivative():
    driven = turning()
    jacobian = jacobian_of(driven, TRUTH)
    for number in range(TRUTH.size):
        step = np.zeros(TRUTH.size)
        step[number] = 1e-3 if number < 3 else 1e-7
        step = step.reshape(TRUTH.shape)
        numeric = (exact_interference(driven, TRUTH + step) - exact_interference(driven, TRUTH - step)) / 2.0
        np.testing.assert_allclose(jacobian[:, number] * step.ravel()[number], numeric, rtol=1e-5, atol=1e-10)


def on_time(driven, target):
    """Rows of a scalar magnetometer that is not late: the derivative by time explains nothing."""
    return FlightRows(driven, target, np.zeros((len(TIME_S), 0)), np.zeros_like)


def fitted(estimation, flights, steps=6, size_groups=False):
    at, shape = np.zeros(TRUTH.shape), UNSHAPED
    for _ in range(steps):
        at, shape, _ = estimation.step(flights, at, shape, size_groups=size_groups)
    return estimation.settled()


def test_the_solution_is_that_of_scipy_for_the_same_problem():
    driven = turning()
    noise = 0.02 * RNG.standard_normal(len(TIME_S))
    target = exact_interference(driven, TRUTH) + noise
    reduction = Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0)
    estimation = Estimation(TABLE, reduction)
    found = fitted(estimation, [on_time(driven, target)])
    size = np.array([signal.size for signal in TABLE]).repeat(3)

    def cost(scaled):
        rest = target - exact_interference(driven, (scaled * size).reshape(-1, 3))
        reduced = reduction([rest[None]])[:, 0] / (found.noise_nt * np.sqrt(reduction.per_row))
        return np.concatenate([reduced, scaled])

    solved = least_squares(cost, np.zeros(TRUTH.size), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    other = exact_interference(driven, (solved.x * size).reshape(-1, 3))
    apart = reduction([(exact_interference(driven, found.coefficients) - other)[None]])
    # what the band does not see is held by the prior alone
    assert np.abs(apart).max() < 2e-6 * np.ptp(other)
    expected = np.linalg.inv(solved.jac.T @ solved.jac) * np.outer(size, size)
    np.testing.assert_allclose(found.errors.ravel(), np.sqrt(np.diag(expected)), rtol=0.02)
    assert found.noise_nt == pytest.approx(np.std(reduction([noise[None]])), rel=0.15)


def test_rows_without_noise_are_explained_where_normal_equations_would_lose_the_weak_directions():
    driven = turning()
    # a signal that hardly drives anything, and one that is nearly another
    signals = [driven.signals, driven.signals[:, 1:2] + 1e-3 * np.sin(TIME_S)[:, None]]
    driven = unbent(driven.background, np.hstack(signals))
    table = (*TABLE, Signal("steel too", "steel too", "1", 0.01))
    truth = np.vstack([TRUTH, [[0.004, -0.003, 0.002]]])
    target = exact_interference(driven, truth)
    reduction = Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0)
    estimation = Estimation(table, reduction)
    at = np.zeros(truth.shape)
    for _ in range(4):
        at = estimation.step([on_time(driven, target)], at, UNSHAPED, size_groups=False).coefficients
    missed = reduction([(target - exact_interference(driven, at))[None]])
    # without the solution by QR it is 0.02 nT
    assert np.std(missed) < 1e-3


def test_errors_of_the_estimate_are_as_large_as_its_scatter():
    driven = turning()
    clean = exact_interference(driven, TRUTH)
    reduction = Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0)
    ratios = []
    for _ in range(60):
        target = clean + 0.02 * RNG.standard_normal(len(TIME_S))
        found = fitted(Estimation(TABLE, reduction), [on_time(driven, target)])
        error = reduction([(exact_interference(driven, found.coefficients) - clean)[None]])
        jacobian = reduction([jacobian_of(driven, found.coefficients).T])
        expected = np.sum((jacobian @ found.root) ** 2, axis=1)
        ratios.append(float(np.mean(error**2) / np.mean(expected)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.3)


def test_a_group_that_explains_nothing_shrinks_to_nothing():
    driven = turning()
    idle = unbent(driven.background, np.column_stack([driven.signals, np.sin(TIME_S), np.cos(0.7 * TIME_S)]))
    table = (*TABLE, Signal("current a", "current a", "nT/A", 10.0), Signal("current b", "current b", "nT/A", 10.0))
    truth = np.vstack([TRUTH, np.zeros((1, 3)), [[0.5, -0.3, 0.4]]])
    target = exact_interference(idle, truth) + 0.02 * RNG.standard_normal(len(TIME_S))
    reduction = Reduction([TIME_S], [np.ones(len(TIME_S), dtype=bool)], 10.0)
    estimation = Estimation(table, reduction)
    at = np.zeros(truth.shape)
    flights = [on_time(idle, target)]
    for number in range(5):
        at = estimation.step(flights, at, UNSHAPED, size_groups=number > 0).coefficients
    found = estimation.settled()
    at = found.coefficients
    assert found.shrunk[4] < 2e-3
    assert np.abs(at[4]).max() < 0.01
    np.testing.assert_allclose(at[5], truth[5], atol=0.05)


def test_flights_of_two_days_have_common_coefficients_and_magnets_of_their_own():
    flights, clean = [], []
    for phase, change in ((0.0, 0.4), (1.3, -0.4)):
        driven = turning(phase)
        moved = TRUTH.copy()
        moved[0] += change
        clean.append(exact_interference(driven, TRUTH))
        target = exact_interference(driven, moved) + 1e-3 * RNG.standard_normal(len(TIME_S))
        flights.append(on_time(driven, target))
    reads = [np.ones(len(TIME_S), dtype=bool)] * 2
    found = fitted(Estimation(TABLE, Reduction([TIME_S, TIME_S], reads, 10.0)), flights)
    # the mean of the two days is found as if there were no days
    error = exact_interference(flights[0].driven, found.coefficients) - clean[0]
    assert np.std(Reduction([TIME_S], reads[:1], 10.0)([error[None]])) < 1e-3
    assert DAY_NT > 0.0
    assert LATER_S > 0.0
