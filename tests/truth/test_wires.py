"""Wiring against closed forms of Biot, Savart and Neumann, and against magpylib."""

import magpylib as magpy
import numpy as np
import pytest

from magsim.field.metal.coils import Loop, inductance
from magsim.field.wiring import wires
from magsim.units import MU0, NT_PER_T

BENT = np.array([[1.2, -0.7, 0.0], [0.9, -0.7, -0.7], [-0.4, -1.0, -0.9], [-0.2, -7.7, -1.0]])


def circle(radius: float, sides: int) -> Loop:
    """Regular polygon of the area of a circle about z."""
    corner = radius * np.sqrt(np.pi / (sides * np.sin(np.pi / sides) * np.cos(np.pi / sides)))
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return Loop(np.column_stack([corner * np.cos(angle), corner * np.sin(angle), np.zeros(sides)]), 0.001)


def conductor(vertices: np.ndarray, share: float = 1.0) -> wires.Conductor:
    return wires.Conductor("one", (Loop(vertices, 0.001),), (share,))


def test_circle_on_its_axis():
    height = np.array([0.0, 0.5, 1.0, 2.0, 10.0])
    points = np.column_stack([np.zeros(5), np.zeros(5), height])
    exact = NT_PER_T * MU0 / (2.0 * (1.0 + height**2) ** 1.5)
    gains = wires.field([wires.Conductor("ring", (circle(1.0, 64),), (1.0,))], points)[:, :, 0]
    np.testing.assert_allclose(gains[:, 2], exact, rtol=1e-6)
    assert np.abs(gains[:, :2]).max() < 1e-9


@pytest.mark.parametrize("sides", [3, 4, 7, 64])
def test_regular_polygon_on_its_axis(sides):
    """The sum over its sides: mu0 A / (2 pi (z^2 + r^2) (z^2 + R^2)^1/2), with r of the sides and R of the corners."""
    height = np.array([-2.0, 0.0, 0.4, 30.0])
    angle = 2.0 * np.pi * np.arange(sides) / sides
    vertices = 1.3 * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    inner, area = 1.3 * np.cos(np.pi / sides), 0.5 * sides * 1.3**2 * np.sin(2.0 * np.pi / sides)
    exact = NT_PER_T * MU0 * area / (2.0 * np.pi * (height**2 + inner**2) * np.hypot(height, 1.3))
    gains = wires.field([conductor(vertices)], np.column_stack([np.zeros(4), np.zeros(4), height]))[..., 0]
    np.testing.assert_allclose(gains[:, 2], exact, rtol=1e-12)


def test_magpylib():
    points = np.random.default_rng(3).normal(size=(60, 3)) * 3.0
    loops = [BENT, wires.pair(BENT, np.array([0.0, 0.01, 0.02])), wires.twisted(BENT, 0.02, 0.3)]
    for vertices in loops:
        closed = np.vstack([vertices, vertices[:1]])
        theirs = NT_PER_T * magpy.current.Polyline(current=1.0, vertices=closed).getB(points)
        ours = wires.field([conductor(vertices)], points)[..., 0]
        # magpylib has mu0 = 4 pi 1e-7 to 1e-10; its sums are of the size of a single wire's field.
        single = NT_PER_T * magpy.current.Polyline(current=1.0, vertices=BENT).getB(points)
        np.testing.assert_allclose(ours, theirs, atol=1e-9 * np.abs(single).max())


def test_long_wire():
    """Away from its far return, a long wire has mu0 I / 2 pi d around it, right-handed."""
    far = 1e4
    vertices = np.array([[-far, 0.0, 0.0], [far, 0.0, 0.0], [far, far, 0.0], [-far, far, 0.0]])
    points = np.array([[0.0, 0.0, 0.5], [3.0, -2.0, 0.0]])
    gains = wires.field([conductor(vertices)], points)[..., 0]
    exact = NT_PER_T * MU0 / (2.0 * np.pi) * np.array([[0.0, -1.0 / 0.5, 0.0], [0.0, 0.0, -1.0 / 2.0]])
    np.testing.assert_allclose(gains, exact, atol=2e-4 * np.abs(exact).max())


def test_pair_is_the_dipole_of_its_strip():
    strip = wires.pair(np.array([[-1e3, 0.0, 0.0], [1e3, 0.0, 0.0]]), np.array([0.0, 0.0, 1e-3]))
    got = wires.field([conductor(strip)], np.array([[0.0, 0.0, -2.0]]))[0, :, 0]
    exact = NT_PER_T * MU0 / (2.0 * np.pi) * (1.0 / 2.0 - 1.0 / 2.001)
    np.testing.assert_allclose(got, [0.0, exact, 0.0], atol=1e-4 * exact)


def test_reciprocity():
    """Flux of a wire's field through a small coil is the mutual inductance."""
    wire = Loop(wires.pair(BENT, np.array([0.0, 0.0, 0.03])), 0.001)
    center = np.array([-0.3, -0.2, 0.1])
    small = Loop(circle(0.002, 24).vertices[:, [2, 0, 1]] + center, 1e-5)
    flux = wires.field([wires.Conductor("w", (wire,), (1.0,))], center[None])[0, :, 0] @ small.area_vector / NT_PER_T
    assert inductance(wire, small) == pytest.approx(flux, rel=1e-4)
    assert inductance(small, wire) == pytest.approx(flux, rel=1e-4)


def test_twisting_takes_the_field_away():
    line = np.array([[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    point = np.array([[0.1, 0.0, -1.0]])
    straight = np.linalg.norm(wires.field([conductor(wires.pair(line, np.array([0.0, 0.0, 0.01])))], point))
    wound = np.linalg.norm(wires.field([conductor(wires.twisted(line, 0.01, 0.1))], point))
    assert wound < 0.01 * straight


def test_twisted_wires_keep_their_distance_and_close():
    vertices = wires.twisted(BENT, 0.02, 0.2, per_turn=32)
    half = len(vertices) // 2
    gap = np.linalg.norm(vertices[:half] - vertices[half:][::-1], axis=1)
    np.testing.assert_allclose(gap, 0.02, rtol=1e-12)
    # A helix is longer than its line by the square root of 1 + (pi s / p)^2.
    line = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    vertices = wires.twisted(line, 0.02, 0.1, per_turn=64)
    one = np.linalg.norm(np.diff(vertices[: len(vertices) // 2], axis=0), axis=1).sum()
    assert one == pytest.approx(3.0 * np.hypot(1.0, np.pi * 0.02 / 0.1), rel=1e-3)


def test_field_has_neither_sources_nor_curl():
    conductors = [conductor(BENT), conductor(wires.twisted(BENT, 0.02, 0.5), share=-0.3)]
    points = np.random.default_rng(4).normal(size=(8, 3)) * 2.0
    step = 1e-4
    shifts = step * np.eye(3)
    slope = np.stack(
        [(wires.field(conductors, points + s) - wires.field(conductors, points - s)) / (2.0 * step) for s in shifts],
        axis=2,
    )
    np.testing.assert_allclose(slope, slope.swapaxes(1, 2), atol=1e-5 * np.abs(slope).max())
    np.testing.assert_allclose(np.einsum("piic->pc", slope), 0.0, atol=1e-5 * np.abs(slope).max())


def test_shares_and_chunks(monkeypatch):
    points = np.random.default_rng(5).normal(size=(23, 3)) * 3.0
    both = wires.Conductor("both", (circle(1.0, 8), circle(2.0, 8)), (0.25, -2.0))
    one, other = (wires.Conductor("x", (loop,), (1.0,)) for loop in both.loops)
    parts = wires.field([one, other], points)
    whole = wires.field([both], points)[..., 0]
    np.testing.assert_allclose(whole, 0.25 * parts[..., 0] - 2.0 * parts[..., 1], rtol=1e-12)
    monkeypatch.setattr(wires, "CHUNK", 24)
    np.testing.assert_array_equal(wires.field([both], points)[..., 0], whole)
