"""Solvers of linear fits, against numpy's least squares, normal equations and singular values by hand."""

import numpy as np
import pytest

from magsim.compensation.columns import TollesLawsonColumns
from magsim.compensation.solvers import LAMBDAS, SOLVERS, least_squares, principal_components, ridge, truncated_svd
from magsim.signals import in_band
from magsim.threads import one_blas_thread
from tests.support.worlds import VECTOR, calibration, parts


def noisy(seed, rows=80, columns=6):
    """Columns of very different sizes, two of them nearly alike, and a noisy target."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(rows, columns)) * 10.0 ** rng.integers(-4, 5, columns)
    matrix[:, -1] = matrix[:, -2] * (1.0 + 0.01 * rng.normal(size=rows))
    return matrix, matrix @ (1.0 / np.std(matrix, axis=0)) + 3.0 * rng.normal(size=rows)


def scaled(matrix):
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    return matrix / scale, scale


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_all_equal_least_squares_on_exact_data(solve):
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(300, 5)) * [1.0, 1e4, 1e-5, 3.0, 1.0]
    truth = np.array([2.0, 1e-4, 3e4, -1.0, 0.5])
    fit = solve(matrix, matrix @ truth)
    np.testing.assert_allclose(fit.coefficients, truth, rtol=1e-9)
    assert fit.residual_std < 1e-7 * np.std(matrix @ truth)
    assert fit.weight == (LAMBDAS[0] if solve is ridge else 0.0)


@pytest.mark.parametrize("solve", SOLVERS.values(), ids=SOLVERS)
def test_residual_and_condition_are_those_of_the_answer(solve):
    matrix, target = noisy(2)
    fit = solve(matrix, target)
    np.testing.assert_allclose(fit.residual_std, np.sqrt(np.mean((target - matrix @ fit.coefficients) ** 2)), rtol=1e-9)
    np.testing.assert_allclose(fit.condition, np.linalg.cond(scaled(matrix)[0]), rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_least_squares_are_numpys(seed):
    matrix, target = noisy(seed)
    a, scale = scaled(matrix)
    expected = np.linalg.lstsq(a, target)[0] / scale
    np.testing.assert_allclose(least_squares(matrix, target).coefficients, expected, rtol=1e-9)


def test_of_an_exact_dependency_least_squares_take_the_shortest_answer():
    rng = np.random.default_rng(4)
    base = rng.normal(size=(200, 3))
    matrix = np.column_stack([base, base.sum(axis=1)])
    target = base @ [1.0, 2.0, 3.0] + rng.normal(size=200)
    a, scale = scaled(matrix)
    expected = np.linalg.lstsq(a, target, rcond=1e-10)[0] / scale
    fit = least_squares(matrix, target)
    np.testing.assert_allclose(fit.coefficients, expected, rtol=1e-9)
    assert fit.condition > 1e12


def test_a_column_of_zeros_has_the_coefficient_zero():
    matrix, target = noisy(5)
    wide = np.column_stack([matrix, np.zeros(len(matrix))])
    for solve in SOLVERS.values():
        fit = solve(wide, target)
        np.testing.assert_allclose(fit.coefficients[:-1], solve(matrix, target).coefficients, rtol=1e-6)
        assert fit.coefficients[-1] == 0.0
        assert fit.condition > 1e12


def test_ridge_solves_its_equations_for_the_weight_that_it_names():
    """Against the normal equations on scaled columns, at a weight that noise makes large."""
    matrix, target = noisy(2)
    fit = ridge(matrix, target)
    assert fit.weight > 1e-6
    a, scale = scaled(matrix)
    top = np.linalg.eigvalsh(a.T @ a)[-1]
    expected = np.linalg.solve(a.T @ a + fit.weight * top * np.eye(6), a.T @ target) / scale
    np.testing.assert_allclose(fit.coefficients, expected, rtol=1e-8)


def test_weight_of_ridge_is_that_of_least_generalized_cross_validation():
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(60, 8))
    target = matrix[:, 0] + 2.0 * rng.normal(size=60)
    a, _ = scaled(matrix)
    top = np.linalg.eigvalsh(a.T @ a)[-1]

    def gcv(weight):
        hat = a @ np.linalg.solve(a.T @ a + weight * top * np.eye(8), a.T)
        return np.mean((target - hat @ target) ** 2) / (1.0 - np.trace(hat) / 60) ** 2

    assert ridge(matrix, target).weight == LAMBDAS[np.argmin([gcv(weight) for weight in LAMBDAS])]


@pytest.mark.parametrize("seed", range(4))
def test_truncation_keeps_as_many_singular_values_as_cross_validation_finds_best(seed):
    """By hand: the answer of rank k for every k, its hat matrix, and the score of generalized cross-validation."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(50, 7)) @ np.diag([1.0, 1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3]) @ rng.normal(size=(7, 7))
    target = matrix @ rng.normal(size=7) + 0.5 * rng.normal(size=50)
    a, scale = scaled(matrix)
    left, singular, right = np.linalg.svd(a, full_matrices=False)
    answers, scores = [], []
    for k in range(1, 8):
        inverse = right[:k].T @ np.diag(1.0 / singular[:k]) @ left[:, :k].T
        hat = a @ inverse
        answers.append(inverse @ target / scale)
        scores.append(np.mean((target - hat @ target) ** 2) / (1.0 - np.trace(hat) / 50) ** 2)
    best = int(np.argmin(scores))
    assert best < 6
    np.testing.assert_allclose(truncated_svd(matrix, target).coefficients, answers[best], rtol=1e-7)


@pytest.mark.parametrize("share", [0.3, 0.9, 0.99999, 1.0])
def test_principal_components_are_a_regression_on_the_scores_that_hold_a_share_of_the_variance(share):
    """By hand: eigenvectors of the covariance of the scaled columns, regression on the scores, mapped back."""
    matrix, target = noisy(6)
    a, scale = scaled(matrix)
    values, vectors = np.linalg.eigh(a.T @ a / len(a))
    values, vectors = values[::-1], vectors[:, ::-1]
    count = next(k for k in range(1, 7) if values[:k].sum() >= share * values.sum() * (1.0 - 1e-12))
    scores = a @ vectors[:, :count]
    expected = vectors[:, :count] @ np.linalg.lstsq(scores, target)[0] / scale
    np.testing.assert_allclose(principal_components(matrix, target, share).coefficients, expected, rtol=1e-7)
    if share == 1.0:
        np.testing.assert_allclose(expected, least_squares(matrix, target).coefficients, rtol=1e-7)
    if share == 0.3:
        assert count < 3


@pytest.mark.parametrize("solve", [ridge, truncated_svd, least_squares, principal_components])
def test_an_exact_dependency_is_survived(solve):
    rng = np.random.default_rng(4)
    base = rng.normal(size=(200, 3))
    matrix = np.column_stack([base, base.sum(axis=1)])
    fit = solve(matrix, base @ [1.0, 2.0, 3.0])
    np.testing.assert_allclose(matrix @ fit.coefficients, base @ [1.0, 2.0, 3.0], rtol=1e-9)
    assert fit.condition > 1e12


def test_a_weight_on_unscaled_columns_shrinks_the_answer():
    """The trap: (X^T X + lambda I)^-1 X^T y on columns of 1 and of 45,000 nT (MagNav.jl's default weight, 0.025)."""
    train, _, _ = parts(calibration(VECTOR))
    columns = TollesLawsonColumns(16, "cabin", strength_nt=1.0)(train).matrix
    rows = in_band(np.column_stack([columns, train["interference_cabin_nt"]]), train.time_s)
    x, y = rows[:, :-1], rows[:, -1]
    with one_blas_thread():
        naive = np.linalg.solve(x.T @ x + 0.025 * len(x) * np.eye(16), x.T @ y)
    assert np.std(y - x @ naive) > 10.0 * np.std(y - x @ ridge(x, y).coefficients)
