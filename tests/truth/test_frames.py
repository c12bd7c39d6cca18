"""Frames there and back, against scipy's rotations and the matrix as it is printed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magsim import frames
from tests.support import rotations


def attitudes(n=500, seed=0):
    rng = np.random.default_rng(seed)
    return np.stack(
        [rng.uniform(-np.pi, np.pi, n), np.arcsin(rng.uniform(-1, 1, n)), rng.uniform(-np.pi, np.pi, n)], axis=1
    )


def test_against_scipy():
    angles = attitudes()
    wanted = Rotation.from_euler("ZYX", angles[:, ::-1]).as_matrix()
    np.testing.assert_allclose(frames.rot_nb_from_attitude(angles), wanted, atol=1e-15)


def test_against_the_printed_matrix():
    """NED to body, transposed: B_b = R_bn B_n."""
    ph, th, ps = 0.3, -0.2, 2.2
    (sr, cr), (sp, cp), (sy, cy) = ((np.sin(v), np.cos(v)) for v in (ph, th, ps))
    printed = [
        [cp * cy, cp * sy, -sp],
        [sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp],
        [cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp],
    ]
    np.testing.assert_allclose(frames.rot_nb_from_attitude(np.array([ph, th, ps])).T, printed, atol=1e-16)


def test_there_and_back():
    angles = attitudes()
    rot = frames.rot_nb_from_attitude(angles)
    np.testing.assert_allclose(rotations.attitude_from_rot_nb(rot), angles, rtol=0, atol=1e-7)
    back = frames.rot_nb_from_attitude(rotations.attitude_from_rot_nb(rot))
    np.testing.assert_allclose(back, rot, rtol=0, atol=1e-14)
    vectors = np.random.default_rng(1).normal(size=(len(angles), 3))
    np.testing.assert_allclose(frames.rotate_back(rot, frames.rotate(rot, vectors)), vectors, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("attitude", "vector_b", "vector_n"),
    [
        ((0, 0, 90), (1, 0, 0), (0, 1, 0)),  # heading east: the nose points east
        ((0, 10, 0), (1, 0, 0), (np.cos(np.radians(10)), 0, -np.sin(np.radians(10)))),  # pitch up: the nose rises
        ((90, 0, 0), (0, 1, 0), (0, 0, 1)),  # roll right: the right wing goes down
    ],
)
def test_signs(attitude, vector_b, vector_n):
    rot = frames.rot_nb_from_attitude(np.radians(attitude))
    np.testing.assert_allclose(frames.rotate(rot, np.array(vector_b, dtype=float)), vector_n, atol=1e-15)


def test_quaternions_are_those_of_scipy_and_lead_back():
    angles, others = attitudes(), attitudes(seed=1)
    first, second = frames.quaternion_nb_from_attitude(angles), frames.quaternion_nb_from_attitude(others)
    np.testing.assert_allclose(
        Rotation.from_quat(first, scalar_first=True).as_matrix(), frames.rot_nb_from_attitude(angles), atol=1e-15
    )
    both = Rotation.from_quat(first, scalar_first=True) * Rotation.from_quat(second, scalar_first=True)
    product = Rotation.from_quat(frames.quaternion_product(first, second), scalar_first=True)
    np.testing.assert_allclose(product.as_matrix(), both.as_matrix(), atol=1e-14)
    one = frames.quaternion_product(frames.quaternion_inverse(first), first)
    np.testing.assert_allclose(one, np.broadcast_to([1.0, 0.0, 0.0, 0.0], one.shape), atol=1e-15)
    # Near the vertical roll and heading are known less well apart, and as well as ever together.
    back = frames.attitude_from_quaternion_nb(3.0 * first)
    np.testing.assert_allclose(back[:, 1], angles[:, 1], rtol=0, atol=1e-15)
    level = np.abs(angles[:, 1]) < 1.5
    np.testing.assert_allclose(back[level], angles[level], rtol=0, atol=1e-14)


@pytest.mark.parametrize("short", [0.0, 1e-12, 1e-9, 1e-4])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_quaternions_lead_back_at_the_vertical(short, side):
    angles = attitudes()
    angles[:, 1] = side * (np.pi / 2 - short)
    back = frames.attitude_from_quaternion_nb(frames.quaternion_nb_from_attitude(angles))
    np.testing.assert_allclose(
        frames.rot_nb_from_attitude(back), frames.rot_nb_from_attitude(angles), rtol=0, atol=2e-15
    )


def test_body_rates_are_those_of_small_turns():
    angles, step = attitudes(), 1e-6
    change = np.random.default_rng(2).normal(size=angles.shape)
    before, after = (
        Rotation.from_matrix(frames.rot_nb_from_attitude(angles + sign * step * change)) for sign in (-1, 1)
    )
    turned = (before.inv() * after).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(rotations.body_rates(angles, change), turned, atol=1e-8)
