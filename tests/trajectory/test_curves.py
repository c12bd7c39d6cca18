"""Compiled evaluation of curves: scipy's own values, to the last bit."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from magsim.trajectory.curves import values_on
from magsim.trajectory.motion import hermite_spline

KNOTS = np.linspace(-3.0, 5.0, 41)
RNG = np.random.default_rng(8)
INSIDE = np.concatenate([np.linspace(-3.0, 5.0, 500), KNOTS, RNG.uniform(-3.0, 5.0, 200), [-3.0 - 1e-9, 5.0 + 1e-9]])


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("degree", [3, 5])
def test_values_are_those_of_scipy(degree: int, order: int) -> None:
    values, slopes = RNG.normal(size=(2, len(KNOTS), 4))
    curve = CubicSpline(KNOTS, values) if degree == 3 else hermite_spline(KNOTS, values, slopes)
    assert curve.c.shape[0] == degree + 1
    np.testing.assert_array_equal(values_on(curve, INSIDE, order), curve(INSIDE, order))


def test_of_no_times_there_are_no_values() -> None:
    assert values_on(CubicSpline(KNOTS, np.zeros((len(KNOTS), 2))), np.zeros(0)).shape == (0, 2)
