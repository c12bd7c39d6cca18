"""Standardized inputs."""

import numpy as np

from magsim.compensation.networks.scaling import Moments, Standardizer


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


def test_moments_of_parts_are_those_of_all_rows():
    """Three columns: a plain one; a deviation of 1e-3 on a mean of 5e4; parts that lie far from each other."""
    rng = np.random.default_rng(2)
    parts = [rng.normal(size=(n, 3)) * [1.0, 1e-3, 2.0] + [0.0, 5e4, 100.0 * n] for n in (1, 300, 2, 41)]
    whole = np.concatenate(parts)
    merged = Moments.of(whole[:0])
    for part in parts:
        merged += Moments.of(part)
    assert merged.count == 344
    np.testing.assert_allclose(merged.mean, whole.mean(axis=0), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(merged.variance), whole.std(axis=0), rtol=1e-9)
    np.testing.assert_array_equal(merged.size, np.abs(whole).max(axis=0))
    of_one = Moments.of(whole[:, 0])
    np.testing.assert_array_equal(of_one.variance, [whole[:, 0].var()])


def test_a_constant_column_in_parts_keeps_its_scale():
    """Rounding leaves a deviation of some 1e-12 of the values, which must not be divided by."""
    column = np.full((1000, 1), 45_000.1)
    standardizer = Standardizer.of([column[:300], column[300:], column[:7]])
    assert standardizer.scale.tolist() == [1.0]
    np.testing.assert_allclose(standardizer(column + 2.0), 2.0, atol=1e-6)
