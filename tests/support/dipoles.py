"""The gradient of a point dipole, as a reference."""

import numpy as np

from magsim.field.sources.dipoles import SCALE


def dipole_gradient(position: np.ndarray, moment: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the derivatives ``dB_i/dx_j`` of ``dipole_field``, (..., 3, 3) [nT/m]; symmetric and free of trace."""
    ray = np.asarray(points, dtype=float) - position
    moment = np.broadcast_to(np.asarray(moment, dtype=float), ray.shape)
    dist = np.sqrt(np.einsum("...x,...x->...", ray, ray))[..., None, None]
    along = np.einsum("...x,...x->...", ray, moment)[..., None, None]
    mixed = np.einsum("...i,...j->...ij", moment, ray)
    return (3.0 * SCALE) * (
        (mixed + np.swapaxes(mixed, -1, -2) + along * np.eye(3)) / dist**5
        - 5.0 * along * np.einsum("...i,...j->...ij", ray, ray) / dist**7
    )
