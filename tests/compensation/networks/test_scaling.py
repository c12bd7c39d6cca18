"""Standardized inputs."""

import numpy as np

from magsim.compensation.networks.scaling import Standardizer


def test_columns_have_zero_mean_and_unit_deviation_on_the_rows_that_were_seen():
    matrix = np.random.default_rng(0).normal(5.0, 3.0, (500, 2)) * [1.0, 1e-6] + [0.0, 1.0]
    matrix = np.column_stack([matrix, np.full(500, 7.0)])
    scaled = Standardizer.of([matrix[:200], matrix[200:]])(matrix)
    np.testing.assert_allclose(scaled.mean(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(scaled.std(axis=0), [1.0, 1.0, 0.0], atol=1e-6)


def test_other_rows_are_scaled_alike():
    rng = np.random.default_rng(1)
    seen, other = rng.normal(size=(100, 3)), 9.0 + rng.normal(size=(50, 3))
    expected = (other - seen.mean(axis=0)) / seen.std(axis=0)
    np.testing.assert_allclose(Standardizer.of([seen])(other), expected, rtol=1e-12)


def test_a_constant_column_keeps_its_scale():
    """Rounding leaves a deviation of some 1e-12 of the values, which must not be divided by."""
    column = np.full((1000, 1), 45_000.1)
    standardizer = Standardizer.of([column])
    assert standardizer.scale.tolist() == [1.0]
    np.testing.assert_allclose(standardizer(column + 2.0), 2.0, atol=1e-6)
