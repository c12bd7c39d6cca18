import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from magsim import frames
from tests.support import rotations


def test_pitch_of_a_rotation_off_by_rounding():
    rot = frames.rot_nb_from_attitude(np.array([0.0, np.pi / 2, 0.0]))
    rot[2, 0] = -1.0 - 1e-15
    assert rotations.attitude_from_rot_nb(rot)[1] == pytest.approx(np.pi / 2)


def test_rotate_broadcasts_one_vector():
    rot = frames.rot_nb_from_attitude(np.zeros((4, 3)))
    np.testing.assert_array_equal(frames.rotate(rot, np.array([1.0, 2.0, 3.0])), np.tile([1.0, 2.0, 3.0], (4, 1)))


def test_rotate_about_follows_the_right_hand():
    out = rotations.rotate_about(np.array([0.0, 1.0, 0.0]), np.array([0.0, np.pi / 2]), np.array([1.0, 5.0, 0.0]))
    # About the right wing, trailing edge down: what points forward turns up, -z.
    np.testing.assert_allclose(out, [[1.0, 5.0, 0.0], [0.0, 5.0, -1.0]], atol=1e-15)


def test_rotate_about_against_scipy():
    rng = np.random.default_rng(0)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle, vector = rng.uniform(-4, 4, 50), rng.normal(size=3)
    wanted = Rotation.from_rotvec(angle[:, None] * axis).apply(vector)
    np.testing.assert_allclose(rotations.rotate_about(axis, angle, vector), wanted, atol=1e-14)


@given(st.floats(-1e3, 1e3))
def test_wrap(angle):
    wrapped = frames.wrap_pi(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.sin((wrapped - angle) / 2) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("angle", [-np.pi, np.pi, -np.pi - 4e-16, np.nextafter(-np.pi, -4), 3 * np.pi])
def test_wrap_at_the_seam(angle):
    assert -np.pi <= frames.wrap_pi(angle) < np.pi
