"""Rotations between the frames of the conventions page (``magsim/__init__.py``), for arrays of attitudes.

Attitude is ``(..., 3)`` [rad]: roll, pitch, heading, applied in the order heading (z), pitch (y), roll (x).
A quaternion is ``(..., 4)``, scalar first; ``quaternion_product`` chains two as matrices are chained.
"""

import numpy as np


def rot_nb_from_attitude(attitude: np.ndarray) -> np.ndarray:
    """Return the rotation from body to north-east-down axes.

    Parameters
    ----------
    attitude : (..., 3) [rad]
        Roll, pitch, heading.

    Returns
    -------
    (..., 3, 3)
        ``rot_nb`` with ``v_n = rot_nb @ v_b`` (Stevens and Lewis, Aircraft Control and Simulation, eq. 1.3-10,
        transposed).
    """
    attitude = np.asarray(attitude, dtype=float)
    sin, cos = np.sin(attitude), np.cos(attitude)
    sr, sp, sh = sin[..., 0], sin[..., 1], sin[..., 2]
    cr, cp, ch = cos[..., 0], cos[..., 1], cos[..., 2]
    rot = np.empty((*attitude.shape[:-1], 3, 3))
    rot[..., 0, 0] = cp * ch
    rot[..., 0, 1] = sr * sp * ch - cr * sh
    rot[..., 0, 2] = cr * sp * ch + sr * sh
    rot[..., 1, 0] = cp * sh
    rot[..., 1, 1] = sr * sp * sh + cr * ch
    rot[..., 1, 2] = cr * sp * sh - sr * ch
    rot[..., 2, 0] = -sp
    rot[..., 2, 1] = sr * cp
    rot[..., 2, 2] = cr * cp
    return rot


def quaternion_product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return Hamilton's product of ``(..., 4)`` quaternions, that of the product of their rotation matrices."""
    w, x, y, z = np.moveaxis(first, -1, 0)
    a, b, c, d = np.moveaxis(second, -1, 0)
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=-1,
    )


def quaternion_inverse(quaternion: np.ndarray) -> np.ndarray:
    """Return the quaternions ``(..., 4)`` of the inverse rotations; unit length is preserved."""
    return quaternion * np.array([1.0, -1.0, -1.0, -1.0])


def quaternion_nb_from_attitude(attitude: np.ndarray) -> np.ndarray:
    """Return the quaternion of ``rot_nb``.

    Parameters
    ----------
    attitude : (..., 3) [rad]
        Roll, pitch, heading.

    Returns
    -------
    (..., 4)
        Of length 1; continuous where the attitude is (Stevens and Lewis, Aircraft Control and Simulation, eq. 1.3-33).
    """
    half = 0.5 * np.asarray(attitude, dtype=float)
    (sr, sp, sh), (cr, cp, ch) = np.moveaxis(np.sin(half), -1, 0), np.moveaxis(np.cos(half), -1, 0)
    return np.stack(
        [
            ch * cp * cr + sh * sp * sr,
            ch * cp * sr - sh * sp * cr,
            ch * sp * cr + sh * cp * sr,
            sh * cp * cr - ch * sp * sr,
        ],
        axis=-1,
    )


def attitude_from_quaternion_nb(quaternion: np.ndarray) -> np.ndarray:
    """Return the attitude of a quaternion of ``rot_nb``.

    The quaternion of an attitude gives half the sum and half the difference of heading and roll as angles in two
    planes, and the pitch by the lengths there: accurate near the vertical too, where only the sum or difference of
    heading and roll is defined. Bernardes and Viollet, PLOS ONE 17 (2022) e0276302, treat all sequences.

    Parameters
    ----------
    quaternion : (..., 4)
        Of any length but 0.

    Returns
    -------
    (..., 3) [rad]
        Roll and heading in [-pi, pi), pitch in [-pi/2, pi/2].
    """
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    half_sum, half_difference = np.arctan2(x + z, w - y), np.arctan2(z - x, w + y)
    pitch = 2.0 * np.arctan2(np.hypot(w + y, z - x), np.hypot(w - y, x + z)) - 0.5 * np.pi
    return np.stack([wrap_pi(half_sum - half_difference), pitch, wrap_pi(half_sum + half_difference)], axis=-1)


def rotate(rot: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply ``(..., 3, 3)`` rotations to ``(..., 3)`` vectors: ``out_i = rot_ij v_j``, without BLAS."""
    return np.einsum("...ij,...j->...i", rot, vectors)


def rotate_back(rot: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply the inverse of ``(..., 3, 3)`` rotations to ``(..., 3)`` vectors: ``out_j = rot_ij v_i``."""
    return np.einsum("...ij,...i->...j", rot, vectors)


def wrap_pi(angle: np.ndarray | float) -> np.ndarray | float:
    """Bring an angle [rad] into [-pi, pi)."""
    wrapped = (np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi
    # Just below -pi the remainder rounds up to a whole turn.
    return np.where(wrapped >= np.pi, -np.pi, wrapped)


def turned_back(rotation: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors in axes that were rotated by rotation vectors (Rodrigues, by the negative angle).

    Parameters
    ----------
    rotation : (n, 3) [rad]
        Axis times angle, in the axes before the rotation.
    vectors : (n, 3)
        In the axes before the rotation.

    Returns
    -------
    (n, 3)
    """
    square = np.einsum("ni,ni->n", rotation, rotation)[:, None]
    angle = np.sqrt(square)
    # sin x / x and (1 - cos x) / x^2 by numpy's sinc, which is exact at zero.
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    across = np.cross(rotation, vectors)
    return vectors - first * across + second * np.cross(rotation, across)
