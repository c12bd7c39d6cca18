"""Rotations between the frames of the conventions page, for arrays of attitudes.

Attitude is ``(..., 3)`` [rad]: roll, pitch, heading, turned in the order heading (z), pitch (y), roll (x).
"""

import numpy as np


def rot_nb_from_attitude(attitude: np.ndarray) -> np.ndarray:
    """Rotation from body to north-east-down axes.

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


def attitude_from_rot_nb(rot_nb: np.ndarray) -> np.ndarray:
    """Roll, pitch, heading [rad] of ``(..., 3, 3)`` rotations; heading in (-pi, pi], pitch in [-pi/2, pi/2]."""
    rot_nb = np.asarray(rot_nb, dtype=float)
    return np.stack(
        [
            np.arctan2(rot_nb[..., 2, 1], rot_nb[..., 2, 2]),
            -np.arcsin(np.clip(rot_nb[..., 2, 0], -1.0, 1.0)),
            np.arctan2(rot_nb[..., 1, 0], rot_nb[..., 0, 0]),
        ],
        axis=-1,
    )


def rotate(rot: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply ``(..., 3, 3)`` rotations to ``(..., 3)`` vectors: ``out_i = rot_ij v_j``, without BLAS."""
    return np.einsum("...ij,...j->...i", rot, vectors)


def rotate_back(rot: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply the inverse of ``(..., 3, 3)`` rotations to ``(..., 3)`` vectors: ``out_j = rot_ij v_i``."""
    return np.einsum("...ij,...i->...j", rot, vectors)


def rotate_about(axis: np.ndarray, angle: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Turn one vector about a fixed unit axis by many angles, right-hand rule (Rodrigues).

    Parameters
    ----------
    axis : (3,)
        Unit vector.
    angle : (n,) [rad]
    vector : (3,)

    Returns
    -------
    (n, 3)
    """
    axis, vector = np.asarray(axis, dtype=float), np.asarray(vector, dtype=float)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return vector * cos + np.cross(axis, vector) * sin + axis * (axis @ vector) * (1.0 - cos)


def wrap_pi(angle: np.ndarray | float) -> np.ndarray | float:
    """Bring an angle [rad] into [-pi, pi)."""
    wrapped = (np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi
    # Just below -pi the remainder rounds up to a whole turn.
    return np.where(wrapped >= np.pi, -np.pi, wrapped)
