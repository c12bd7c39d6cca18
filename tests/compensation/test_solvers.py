import numpy as np
import pytest
from magsim.compensation.features import Inputs, design
from magsim.compensation.ridge import LAMBDAS, fit_ridge

from magsim.compensation.tolles_lawson import in_band
from tests.support.worlds import VECTOR, calibration, parts


def test_equals_least_squares_on_exact_data():
    rng = np.random.default_rng(1)
    matrix = rng.normal(size=(300, 5)) * [1.0, 1e4, 1e-5, 3.0, 1.0]
    truth = np.array([2.0, 1e-4, 3e4, -1.0, 0.5])
    fit = fit_ridge(matrix, matrix @ truth)
    np.testing.assert_allclose(fit.coefficients, truth, rtol=1e-9)
    assert fit.weight == LAMBDAS[0]


def test_solves_the_ridge_equations_for_the_weight_that_it_names():
    """Against the normal equations on scaled columns, at a weight that noise makes large."""
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(80, 6))
    matrix[:, 5] = matrix[:, 4] + 0.01 * rng.normal(size=80)
    target = matrix @ np.ones(6) + 3.0 * rng.normal(size=80)
    fit = fit_ridge(matrix, target)
    assert fit.weight > 1e-6
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    a = matrix / scale
    top = np.linalg.eigvalsh(a.T @ a)[-1]
    expected = np.linalg.solve(a.T @ a + fit.weight * top * np.eye(6), a.T @ target) / scale
    np.testing.assert_allclose(fit.coefficients, expected, rtol=1e-8)
    np.testing.assert_allclose(fit.condition, np.linalg.cond(a), rtol=1e-9)
    np.testing.assert_allclose(fit.residual_std, np.sqrt(np.mean((target - matrix @ expected) ** 2)), rtol=1e-9)


def test_weight_is_that_of_least_generalized_cross_validation():
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(60, 8))
    target = matrix[:, 0] + 2.0 * rng.normal(size=60)
    a = matrix / np.sqrt(np.mean(matrix**2, axis=0))
    top = np.linalg.eigvalsh(a.T @ a)[-1]

    def gcv(weight):
        hat = a @ np.linalg.solve(a.T @ a + weight * top * np.eye(8), a.T)
        return np.mean((target - hat @ target) ** 2) / (1.0 - np.trace(hat) / 60) ** 2

    assert fit_ridge(matrix, target).weight == LAMBDAS[np.argmin([gcv(weight) for weight in LAMBDAS])]


def test_survives_an_exact_dependency():
    rng = np.random.default_rng(4)
    base = rng.normal(size=(200, 3))
    matrix = np.column_stack([base, base.sum(axis=1)])
    fit = fit_ridge(matrix, base @ [1.0, 2.0, 3.0])
    np.testing.assert_allclose(matrix @ fit.coefficients, base @ [1.0, 2.0, 3.0], rtol=1e-9)
    assert fit.condition > 1e12


@pytest.mark.parametrize("weight", [0.025])
def test_a_weight_on_unscaled_columns_shrinks_the_answer(weight):
    """The trap: (X^T X + lambda I)^-1 X^T y on columns of 1 and of 45,000 nT (MagNav.jl's default weight)."""
    train, _, _ = parts(calibration(VECTOR))
    columns = design(train, Inputs("cabin", strength_nt=1.0), ("tl16",)).matrix
    rows = in_band(np.column_stack([columns, train["interference_cabin_nt"]]), train.time_s)
    x, y = rows[:, :-1], rows[:, -1]
    naive = np.linalg.solve(x.T @ x + weight * len(x) * np.eye(16), x.T @ y)
    scaled = fit_ridge(x, y).coefficients
    assert np.std(y - x @ naive) > 10.0 * np.std(y - x @ scaled)
