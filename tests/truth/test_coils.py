"""Loops of wire against closed forms of Maxwell, Neumann, Biot and Savart."""

import magpylib as magpy
import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from magsim.field.metal.coils import Loop, inductance, inductance_matrix
from magsim.units import MU0


def _circle(radius: float, sides: int, height: float = 0.0, wire: float = 0.001) -> Loop:
    """Regular polygon of the area of a circle, right-handed about z."""
    corner = radius * np.sqrt(np.pi / (sides * np.sin(np.pi / sides) * np.cos(np.pi / sides)))
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return Loop(np.column_stack([corner * np.cos(angle), corner * np.sin(angle), np.full(sides, height)]), wire)


def _maxwell(a: float, b: float, z: float) -> float:
    """Mutual inductance of coaxial circles (Maxwell, Treatise, art. 701)."""
    m = 4.0 * a * b / ((a + b) ** 2 + z**2)
    k = np.sqrt(m)
    return MU0 * np.sqrt(a * b) * ((2.0 / k - k) * ellipk(m) - 2.0 / k * ellipe(m))


@pytest.mark.parametrize(("sides", "limit"), [(24, 4e-5), (64, 8e-7), (256, 3.2e-9)])
def test_coaxial_circles_against_maxwell(sides: int, limit: float) -> None:
    first, second = _circle(1.0, sides), _circle(0.6, sides, height=0.5)
    got = inductance(first, second, pieces=1, order=16)
    assert got == pytest.approx(_maxwell(1.0, 0.6, 0.5), rel=limit)
    assert inductance(second, first, pieces=1, order=16) == pytest.approx(got, rel=1e-11)


def test_self_inductance_of_a_circle() -> None:
    radius, wire = 1.0, 0.001
    exact = MU0 * radius * (np.log(8.0 * radius / wire) - 2.0)
    loop = _circle(radius, 256, wire=wire)
    assert inductance(loop, loop, pieces=2) == pytest.approx(exact, rel=5e-5)


def _parallel(length: float, distance: float) -> float:
    """Mutual inductance of two equal parallel filaments side by side."""
    straight = length * np.arcsinh(length / distance) - np.hypot(length, distance) + distance
    return MU0 / (2.0 * np.pi) * straight


def _rectangle(width: float, height: float, wire: float) -> Loop:
    return Loop(np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], dtype=float), wire)


def test_self_inductance_of_a_softened_rectangle() -> None:
    w, h, r = 7.0, 1.5, 0.02
    exact = 2.0 * (_parallel(w, r) - _parallel(w, np.hypot(h, r)) + _parallel(h, r) - _parallel(h, np.hypot(w, r)))
    loop = _rectangle(w, h, r)
    assert inductance(loop, loop) == pytest.approx(exact, rel=1e-12)
    assert inductance(loop, loop, pieces=1, order=32) == pytest.approx(exact, rel=8e-6)


def test_self_inductance_of_a_thin_rectangle() -> None:
    w, h, r = 7.0, 1.5, 0.0002
    g = np.hypot(w, h)
    log = w * np.log(2 * w / r) + h * np.log(2 * h / r)
    exact = MU0 / np.pi * (-2 * (w + h) + 2 * g - h * np.arcsinh(h / w) - w * np.arcsinh(w / h) + log)
    loop = _rectangle(w, h, r)
    assert inductance(loop, loop, pieces=128) == pytest.approx(exact, rel=2e-5)


def test_field_on_the_axis_of_a_circle() -> None:
    height = np.array([0.0, 0.3, 1.0, 4.0])
    points = np.column_stack([np.zeros(4), np.zeros(4), height])
    exact = MU0 / (2.0 * (1.0 + height**2) ** 1.5)
    field = _circle(1.0, 256).field(points)
    np.testing.assert_allclose(field[:, 2], exact, rtol=1e-4)
    np.testing.assert_allclose(_circle(1.0, 64).field(points)[2:, 2], exact[2:], rtol=1e-4)
    assert np.abs(field[:, :2]).max() < 1e-18


def test_field_agrees_with_magpylib() -> None:
    vertices = np.array([[0.6, 0.8, -0.9], [0.6, 7.4, -1.0], [-0.4, 7.4, -0.9], [-1.0, 0.8, -0.8]])
    points = np.random.default_rng(2).normal(size=(50, 3)) * 4.0
    theirs = magpy.current.Polyline(current=1.0, vertices=np.vstack([vertices, vertices[:1]])).getB(points)
    ours = Loop(vertices, 0.02).field(points)
    np.testing.assert_allclose(ours, theirs, atol=1e-9 * np.abs(theirs).max())


def test_area_vector() -> None:
    loop = Loop(np.array([[5.0, 1.0, 2.0], [5.0, 4.0, 2.0], [5.0, 4.0, 4.0], [5.0, 1.0, 4.0]]), 0.01)
    np.testing.assert_allclose(loop.area_vector, [6.0, 0.0, 0.0], atol=1e-15)
    assert loop.length_m == pytest.approx(10.0)


def test_flux_of_a_field_is_the_mutual_inductance() -> None:
    """A small loop far from a big one: M = B . area."""
    big, small = _circle(1.0, 64), _circle(0.01, 32, height=3.0)
    turned = Loop(small.vertices + np.array([0.7, -0.4, 0.0]), 1e-4)
    flux = big.field(np.array([[0.7, -0.4, 3.0]]))[0] @ turned.area_vector
    assert inductance(big, turned) == pytest.approx(flux, rel=1e-4)


def test_matrix_is_symmetric_and_positive() -> None:
    loops = [_circle(1.0, 24, wire=0.05), _circle(0.9, 24, height=0.2, wire=0.05), _rectangle(3.0, 1.0, 0.05)]
    matrix = inductance_matrix(loops)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min() > 0.0
