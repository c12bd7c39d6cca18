"""The kernel against closed forms: Legendre polynomials, a centered dipole."""

import math

import numpy as np
import pytest
from scipy.special import assoc_legendre_p_all

from magsim.earth import harmonics


def test_harmonics_are_legendre_functions():
    position = np.array([[3.1e6, -4.4e6, 4.9e6], [-1e6, 2e5, -7.1e6]])
    got = harmonics.harmonics(position, 12)
    for place, table in zip(position, np.moveaxis(got, 2, 0), strict=True):
        r = np.linalg.norm(place)
        lon = math.atan2(place[1], place[0])
        legendre = assoc_legendre_p_all(12, 12, place[2] / r)[0]
        for n in range(13):
            for m in range(n + 1):
                # scipy has the Condon-Shortley sign, the solid harmonics here do not.
                size = (harmonics.REFERENCE_RADIUS_M / r) ** (n + 1) * legendre[n, m] * (-1) ** m
                wanted = size * np.array([math.cos(m * lon), math.sin(m * lon)])
                np.testing.assert_allclose(table[harmonics.index(n, m)], wanted, rtol=1e-11, atol=1e-12 * abs(size))


@pytest.mark.parametrize(("n", "m", "axis"), [(1, 0, (0, 0, 1)), (1, 1, (1, 0, 0))])
def test_degree_one_is_a_dipole(n, m, axis):
    """g10 and g11 are a dipole at the center, V = a (a/r)^2 g (axis . r/|r|)."""
    g = np.zeros(3)
    g[harmonics.index(n, m)] = -30000.0
    rows = harmonics.contraction(harmonics.complex_coefficients(g, np.zeros(3)), gradient=True)
    position = np.array([[5e6, 3e6, -4e6], [1e6, -6.5e6, 2e6], [0.0, 0.0, 7e6]])
    values = harmonics.evaluate(position, rows, np.zeros_like(rows), np.zeros(3))
    a, moment = harmonics.REFERENCE_RADIUS_M, -30000.0 * np.array(axis)
    r = np.linalg.norm(position, axis=1)[:, None]
    unit = position / r
    along = (unit @ moment)[:, None]
    np.testing.assert_allclose(values[:, :3], (a / r) ** 3 * (3 * along * unit - moment), atol=1e-9)
    gradient = harmonics.unpack_gradient(values[:, 3:])
    eye = np.eye(3)
    wanted = [
        3 * (a / s) ** 3 / s * (np.outer(u, moment) + np.outer(moment, u) + (u @ moment) * (eye - 5 * np.outer(u, u)))
        for u, s in zip(unit, r[:, 0], strict=True)
    ]
    np.testing.assert_allclose(gradient, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max() * 100)


def test_degree_of_a_table():
    for degree in range(1, 20):
        assert harmonics.degree_of(harmonics.index(degree + 1, 0)) == degree
