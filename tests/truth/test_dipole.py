"""Point dipoles against an independent library, closed forms and finite differences; hinges against rotations."""

import magpylib as magpy
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magsim.aircraft import load_aircraft
from magsim.field.sources.dipoles import SCALE, DeflectedDipole, DeflectedDipoles, dipole_field
from magsim.units import NT_PER_T
from tests.support.dipoles import dipole_gradient
from tests.support.rotations import rotate_about

POSITION = np.array([0.4, -0.3, 0.2])
MOMENT = np.array([1.5, -2.0, 0.7])


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    rng = np.random.default_rng(11)
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return POSITION + directions * rng.uniform(0.5, 20.0, (200, 1))


def test_agrees_with_magpylib(points: np.ndarray) -> None:
    source = magpy.misc.Dipole(moment=MOMENT, position=POSITION)
    theirs = source.getB(points) * NT_PER_T
    ours = dipole_field(POSITION, MOMENT, points)
    # The two libraries differ by their mu0: 1.3e-10.
    assert np.abs(ours - theirs).max(axis=1) == pytest.approx(0.0, abs=1e-9 * np.linalg.norm(ours, axis=1).max())
    np.testing.assert_allclose(np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1), rtol=1e-9)


def test_on_the_axis_and_the_equator() -> None:
    moment = np.array([0.0, 0.0, 3.0])
    field = dipole_field(np.zeros(3), moment, np.array([[0.0, 0.0, 2.0], [2.0, 0.0, 0.0]]))
    # 2e-7 m / r^3 along the axis and -1e-7 m / r^3 across it, in tesla.
    np.testing.assert_allclose(field[0], [0.0, 0.0, 2e-7 * 3.0 / 8.0 * 1e9], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(field[1], [0.0, 0.0, -1e-7 * 3.0 / 8.0 * 1e9], rtol=1e-9, atol=1e-12)


def test_flipping_the_moment_flips_the_field(points: np.ndarray) -> None:
    np.testing.assert_array_equal(dipole_field(POSITION, -MOMENT, points), -dipole_field(POSITION, MOMENT, points))


def test_falls_with_the_third_power(points: np.ndarray) -> None:
    near = dipole_field(POSITION, MOMENT, points)
    far = dipole_field(POSITION, MOMENT, POSITION + 3.0 * (points - POSITION))
    np.testing.assert_allclose(27.0 * far, near, rtol=1e-12, atol=1e-12 * np.abs(near).max())


def test_has_neither_sources_nor_currents(points: np.ndarray) -> None:
    step = 1e-4
    slopes = np.stack(
        [
            (dipole_field(POSITION, MOMENT, points + e) - dipole_field(POSITION, MOMENT, points - e)) / (2 * step)
            for e in step * np.eye(3)
        ],
        axis=-1,
    )
    scale = np.abs(slopes).max(axis=(1, 2))
    assert np.all(np.abs(np.trace(slopes, axis1=1, axis2=2)) < 1e-6 * scale)
    assert np.all(np.abs(slopes - np.swapaxes(slopes, 1, 2)).max(axis=(1, 2)) < 1e-6 * scale)


def test_gradient_by_finite_differences(points: np.ndarray) -> None:
    exact = dipole_gradient(POSITION, MOMENT, points)
    step = 1e-3
    for axis, e in enumerate(step * np.eye(3)):
        at = [dipole_field(POSITION, MOMENT, points + k * e) for k in (-2, -1, 1, 2)]
        slope = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
        scale = np.abs(exact).max(axis=(1, 2))[:, None]
        assert np.abs((slope - exact[:, :, axis]) / scale).max() < 1e-7
    scale = np.abs(exact).max()
    assert np.abs(np.trace(exact, axis1=1, axis2=2)).max() < 1e-12 * scale
    assert np.abs(exact - np.swapaxes(exact, 1, 2)).max() < 1e-12 * scale


def deflected(angles: np.ndarray) -> DeflectedDipole:
    return DeflectedDipole(
        position=np.array([-8.0, 1.5, -0.5]),
        moment=np.array([0.5, 0.8, 0.3]),
        hinge_point=np.array([-7.86, 1.2, -0.45]),
        hinge_axis=np.array([0.0, 0.8, 0.6]),
        cos=np.cos(angles),
        sin=np.sin(angles),
    )


HINGED = deflected(np.zeros(1))


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (-11.11, 0.0, -0.82), (-7.5, 1.0, 0.2)])
def test_hinged_dipole_is_a_turned_and_moved_dipole(point: tuple[float, float, float]) -> None:
    angles = np.linspace(-0.6, 0.6, 25)
    turn = Rotation.from_rotvec(angles[:, None] * HINGED.hinge_axis)
    positions = HINGED.hinge_point + turn.apply(HINGED.position - HINGED.hinge_point)
    expected = dipole_field(positions, turn.apply(HINGED.moment), np.array(point))
    dipole, fixed = deflected(angles), np.array([point])
    np.testing.assert_allclose(
        DeflectedDipoles((dipole,)).at(fixed)[:, 0], expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )
    moving = dipole.along(np.tile(fixed, (25, 1, 1)))
    np.testing.assert_allclose(moving[:, 0], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (-11.11, 0.0, -0.82)])
def test_hinged_dipole_as_gains_and_strengths(point: tuple[float, float, float]) -> None:
    """Exact at rest and at the deflection of the expansion, right to 0.1 % of the field between them."""
    dipole, fixed = deflected(np.linspace(-0.2, 0.2, 21)), np.array([point])
    exact = DeflectedDipoles((dipole,)).at(fixed)[:, 0]
    product = dipole.strengths @ dipole.gains(fixed)[0].T
    np.testing.assert_allclose(product[[0, 10, 20]], exact[[0, 10, 20]], rtol=1e-10)
    assert np.abs(product - exact).max() < 1e-3 * np.linalg.norm(exact, axis=1).min()


def test_hinged_dipole_agrees_with_magpylib() -> None:
    angle = np.radians(12.0)
    source = magpy.misc.Dipole(moment=HINGED.moment, position=HINGED.position)
    source.rotate(Rotation.from_rotvec(angle * HINGED.hinge_axis), anchor=HINGED.hinge_point)
    point = np.array([-7.0, 0.4, 0.3])
    ours = DeflectedDipoles((deflected(np.array([angle])),)).at(point[None])[0, 0]
    np.testing.assert_allclose(ours, source.getB(point) * NT_PER_T, rtol=2e-9)


@pytest.mark.parametrize(
    ("axis", "moves_to"),
    [((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0))],
    ids=["about y: trailing edge down", "about z: trailing edge to port"],
)
def test_hinge_signs(axis: tuple[float, float, float], moves_to: tuple[float, float, float]) -> None:
    trailing_edge = rotate_about(np.array(axis), np.array([np.pi / 2]), np.array([-1.0, 0.0, 0.0]))[0]
    np.testing.assert_allclose(trailing_edge, moves_to, atol=1e-15)
    # The field sees the same move: a dipole at the trailing edge, turned by 90 degrees about a hinge in the origin.
    cos, sin = np.array([0.0]), np.array([1.0])
    dipole = DeflectedDipole(np.array([-1.0, 0.0, 0.0]), np.array(axis), np.zeros(3), np.array(axis), cos, sin)
    point = np.array([0.3, 0.2, 5.0])
    field = DeflectedDipoles((dipole,)).at(point[None])[0, 0]
    np.testing.assert_allclose(field, dipole_field(np.array(moves_to), np.array(axis), point), rtol=1e-12)


def test_surfaces_of_the_c208b_turn_the_right_way() -> None:
    hinged = load_aircraft("c208b").magnetics.hinged
    assert {dipole.surface for dipole in hinged} == {"elevator", "aileron_left", "aileron_right", "rudder", "flap"}
    for dipole in hinged:
        arm = np.array(dipole.position_m) - np.array(dipole.hinge_point_m)
        assert arm[0] < 0.0  # behind its hinge
        move = rotate_about(np.array(dipole.hinge_axis), np.array([0.01]), arm)[0] - arm
        assert move[1] < 0.0 if dipole.surface == "rudder" else move[2] > 0.0


def test_scale_is_a_tenth_of_a_microtesla() -> None:
    assert pytest.approx(100.0, rel=2e-10) == SCALE
