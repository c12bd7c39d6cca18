"""Arrays that stay as they are."""

import numpy as np


def readonly(array: np.ndarray) -> np.ndarray:
    """Return the values as C-ordered float64 in memory that cannot be written to.

    The memory is an immutable ``bytes`` object, so that setting ``flags.writeable`` is an error and not a way around.
    An array that came from here, or a contiguous view of one, is returned without a copy.
    """
    out = np.ascontiguousarray(array, dtype=float)
    if _is_immutable(out):
        return out
    return np.ndarray(out.shape, dtype=float, buffer=out.tobytes())


def _is_immutable(array: np.ndarray) -> bool:
    """Whether the array lies in a ``bytes`` object."""
    owner: object = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    return isinstance(owner, bytes)
