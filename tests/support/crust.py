"""Derivatives of the crustal field, as a reference."""

import numpy as np

from magsim.field.background.crust import CrustModes


def gradient_of(modes: CrustModes, place_n: np.ndarray) -> np.ndarray:
    """Return the derivatives ``[j, k] = dB_j / dx_k`` of the field of plane modes, (n, 3, 3) [nT/m]."""
    k, (un, ue) = modes.wavenumber, modes.direction.T
    north, east, down = np.asarray(place_n, dtype=float).T[:, :, None]
    size = modes.amplitude_nt * np.exp(k * down)
    angle = north * (k * un) + east * (k * ue) + modes.phase
    sine, cosine = size * np.sin(angle), size * np.cos(angle)
    entries = {
        (0, 0): cosine @ (k * un * un),
        (0, 1): cosine @ (k * un * ue),
        (1, 1): cosine @ (k * ue * ue),
        (2, 2): -cosine @ k,
        (0, 2): sine @ (k * un),
        (1, 2): sine @ (k * ue),
    }
    out = np.empty((len(place_n), 3, 3))
    for (i, j), values in entries.items():
        out[:, i, j] = out[:, j, i] = values
    return out
