"""Solves on one BLAS thread."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from magsim.threads import one_blas_thread


def threads():
    """Threads of all BLAS libraries."""
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.mark.parametrize("before", [1, 2])
def test_one_thread_inside_and_as_many_as_before_outside(before):
    import scipy.linalg  # noqa: F401 - brings a BLAS of its own

    with threadpool_limits(limits=before, user_api="blas"):
        assert threads() == {before}
        with one_blas_thread():
            assert threads() == {1}
            with one_blas_thread():
                assert threads() == {1}
            assert threads() == {1}
        assert threads() == {before}


def fail():
    with one_blas_thread():
        assert threads() == {1}
        raise KeyError


def test_threads_are_restored_after_an_error():
    with threadpool_limits(limits=2, user_api="blas"):
        with pytest.raises(KeyError):
            fail()
        assert threads() == {2}


def test_solves_have_the_same_bits_whatever_the_threads():
    matrix = np.random.default_rng(0).normal(size=(3000, 40))
    found = []
    for count in (1, 2):
        with threadpool_limits(limits=count, user_api="blas"), one_blas_thread():
            found.append(np.linalg.svd(matrix, full_matrices=False))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)
