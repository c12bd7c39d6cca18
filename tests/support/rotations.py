"""Rotations that tests need and the simulator does not: attitudes back from matrices, rates, turns about an axis."""

import numpy as np


def attitude_from_rot_nb(rot_nb: np.ndarray) -> np.ndarray:
    """Return roll, pitch, heading [rad] of ``(..., 3, 3)`` rotations; heading in (-pi, pi], pitch in [-pi/2, pi/2]."""
    rot_nb = np.asarray(rot_nb, dtype=float)
    return np.stack(
        [
            np.arctan2(rot_nb[..., 2, 1], rot_nb[..., 2, 2]),
            -np.arcsin(np.clip(rot_nb[..., 2, 0], -1.0, 1.0)),
            np.arctan2(rot_nb[..., 1, 0], rot_nb[..., 0, 0]),
        ],
        axis=-1,
    )


def body_rates(attitude: np.ndarray, attitude_rate: np.ndarray) -> np.ndarray:
    """Return the angular rate of the body relative to the local axes, in body axes, of a changing attitude.

    Parameters
    ----------
    attitude : (..., 3) [rad]
        Roll, pitch, heading.
    attitude_rate : (..., 3) [rad/s]
        Their time derivatives.

    Returns
    -------
    (..., 3) [rad/s]
        Stevens, Lewis, Johnson, Aircraft Control and Simulation, eq. 1.4-3.
    """
    roll, pitch, _ = np.moveaxis(np.asarray(attitude, dtype=float), -1, 0)
    rolling, pitching, turning = np.moveaxis(np.asarray(attitude_rate, dtype=float), -1, 0)
    p = rolling - np.sin(pitch) * turning
    q = np.cos(roll) * pitching + np.sin(roll) * np.cos(pitch) * turning
    r = -np.sin(roll) * pitching + np.cos(roll) * np.cos(pitch) * turning
    return np.stack([p, q, r], axis=-1)


def rotate_about(axis: np.ndarray, angle: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Rotate one vector about a fixed unit axis by many angles, right-hand rule (Rodrigues).

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
