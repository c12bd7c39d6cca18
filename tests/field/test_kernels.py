"""Compiled loops against the same sums by scipy and numpy."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from magsim.field import kernels

RNG = np.random.default_rng(4)
KNOTS = np.concatenate([[-3.0], np.sort(RNG.uniform(-3.0, 5.0, 40)), [5.0]])
TIME = np.linspace(-3.0, 5.0, 501)
ROT_BE = Rotation.random(len(TIME), random_state=1).as_matrix()
VALUES = RNG.normal(size=(len(KNOTS), 19))


def test_splines_are_those_of_scipy_in_the_axes_of_the_body():
    curve = CubicSpline(KNOTS, VALUES[:, :3])
    got = kernels.spline_in_body(curve.c, KNOTS, TIME, ROT_BE)
    np.testing.assert_allclose(got, np.einsum("nij,nj->ni", ROT_BE, curve(TIME)), rtol=0, atol=1e-11)


@pytest.mark.parametrize("order", [1, 2])
def test_a_field_is_expanded_by_its_derivatives(order):
    """A polynomial potential: its field at the arm's end is that of the expansion itself."""
    width = 9 if order == 1 else 19
    curve, arms_b = CubicSpline(KNOTS, VALUES[:, :width]), RNG.normal(size=(3, 3))
    got = kernels.expanded_in_body(curve.c, KNOTS, TIME, ROT_BE, arms_b)
    table, gradient = curve(TIME), np.empty((len(TIME), 3, 3))
    rows, columns = np.triu_indices(3)
    gradient[:, rows, columns] = gradient[:, columns, rows] = table[:, 3:9]
    triples = [(i, j, k) for i in range(3) for j in range(i, 3) for k in range(j, 3)]
    for p, arm_b in enumerate(arms_b):
        arm_e = np.einsum("nij,i->nj", ROT_BE, arm_b)
        field = table[:, :3] + np.einsum("nij,nj->ni", gradient, arm_e)
        if order == 2:
            for i in range(3):
                for j in range(3):
                    for k in range(3):
                        value = table[:, 9 + triples.index(tuple(sorted((i, j, k))))]
                        field[:, i] += 0.5 * value * arm_e[:, j] * arm_e[:, k]
        np.testing.assert_allclose(got[p], np.einsum("nij,nj->ni", ROT_BE, field), rtol=0, atol=1e-10)


def test_gains_times_strengths():
    gains, strengths = RNG.normal(size=(4, 3, 7)), RNG.normal(size=(50, 7))
    expected = np.einsum("sic,nc->sni", gains, strengths)
    np.testing.assert_allclose(kernels.summed(gains, strengths), expected, rtol=0, atol=1e-13)


def test_modes_are_recursive_filters():
    driven, start = RNG.normal(size=(200, 5)), RNG.normal(size=5)
    steps = np.stack([RNG.uniform(0.1, 0.9, 5), RNG.normal(size=5), RNG.normal(size=5)])
    got = driven.copy()
    kernels.step_modes(got, steps, start)
    for k in range(5):
        decay, before, now = steps[:, k]
        expected = lfilter([now, before], [1.0, -decay], driven[:, k], zi=[start[k] - now * driven[0, k]])[0]
        np.testing.assert_allclose(got[:, k], expected, rtol=0, atol=1e-12)
