"""Dipoles that move: places and moments by hand, gradients by differences, and their linear form."""

import numpy as np
import pytest

from magsim.field.sources.dipoles import dipole_field
from magsim.field.sources.moving import LinkedDipole, SeatedDipole, dipole_gradient
from tests.support.rotations import rotate_about

POINTS = np.array([[0.0, 0.0, 0.0], [-3.0, 0.4, 0.5], [0.3, 0.36, 0.55]])
PLACE, MOMENT = np.array([1.4, -0.4, 0.1]), np.array([0.2, -0.1, 0.3])
ANGLE = np.radians(np.linspace(-20.0, 20.0, 41))


def yoke(**changes: object) -> LinkedDipole:
    given = {
        "travel": np.array([0.23, 0.0, 0.05]),
        "turn": -4.0,
        "turn_point": np.array([1.4, -0.3, 0.0]),
        "turn_axis": np.array([0.8, 0.0, 0.6]),
    }
    return LinkedDipole(PLACE, MOMENT, **(given | changes), angle=ANGLE)


def test_the_gradient_is_that_of_the_field():
    step = 1e-4
    sides = [[dipole_field(PLACE, MOMENT, POINTS + sign * step * e) for sign in (1, -1)] for e in np.eye(3)]
    numeric = np.stack([(ahead - behind) / (2.0 * step) for ahead, behind in sides], axis=2)
    exact = dipole_gradient(PLACE, MOMENT, POINTS)
    np.testing.assert_allclose(exact, numeric, rtol=0, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(exact, exact.transpose(0, 2, 1), rtol=1e-12)
    assert np.abs(np.trace(exact, axis1=1, axis2=2)).max() < 1e-12 * np.abs(exact).max()


def test_a_control_goes_and_turns_with_its_surface():
    dipole, point, axis = yoke(), np.array([1.4, -0.3, 0.0]), np.array([0.8, 0.0, 0.6])
    place = point + rotate_about(axis, -4.0 * ANGLE, PLACE - point) + np.outer(ANGLE, [0.23, 0.0, 0.05])
    moment = rotate_about(axis, -4.0 * ANGLE, MOMENT)
    exact = np.stack([dipole_field(place, moment, at) for at in POINTS], axis=1)
    np.testing.assert_allclose(dipole.at(POINTS), exact, rtol=1e-12)
    moving = POINTS + 0.1 * np.sin(ANGLE)[:, None, None]
    exact = np.stack([dipole_field(place, moment, moving[:, s]) for s in range(3)], axis=1)
    np.testing.assert_allclose(dipole.along(moving), exact, rtol=1e-12)


def test_at_rest_it_is_a_fixed_dipole():
    rest = LinkedDipole(PLACE, MOMENT, np.ones(3), 2.0, PLACE, np.array([0.0, 1.0, 0.0]), np.zeros(1))
    np.testing.assert_allclose(rest.at(POINTS)[0], dipole_field(PLACE, MOMENT, POINTS), rtol=1e-14)


@pytest.mark.parametrize(("turn", "within"), [(0.0, 1e-2), (-1.0, 2e-2)])
def test_the_linear_form_holds_to_second_order(turn, within):
    dipole = yoke(turn=turn)
    exact = dipole.at(POINTS)
    linear = np.einsum("sic,nc->nsi", dipole.gains(POINTS), dipole.strengths)
    change = np.abs(exact - exact[20]).max()
    assert np.abs(linear - exact).max() < within * change


def test_a_person_goes_and_turns_about_the_vertical():
    posture = np.column_stack([0.04 * np.sin(9.0 * ANGLE), 0.1 * ANGLE, 0.01 * np.cos(5.0 * ANGLE), 0.5 * ANGLE])
    person = SeatedDipole(PLACE, MOMENT, posture)
    turned = rotate_about(np.array([0.0, 0.0, 1.0]), posture[:, 3], MOMENT)
    exact = np.stack([dipole_field(PLACE + posture[:, :3], turned, at) for at in POINTS], axis=1)
    exact -= dipole_field(PLACE, MOMENT, POINTS)
    np.testing.assert_allclose(person.at(POINTS), exact, rtol=0, atol=1e-12)
    moving = np.broadcast_to(POINTS, (len(ANGLE), 3, 3))
    np.testing.assert_allclose(person.along(moving), exact, rtol=0, atol=1e-12)
    assert np.abs(SeatedDipole(PLACE, MOMENT, np.zeros((2, 4))).at(POINTS)).max() < 1e-13
    # The linear form, for ways a hundredth as large.
    small = SeatedDipole(PLACE, MOMENT, 0.01 * posture)
    linear = np.einsum("sic,nc->nsi", small.gains(POINTS), small.strengths)
    np.testing.assert_allclose(linear, small.at(POINTS), rtol=0, atol=5e-3 * np.abs(linear).max())
