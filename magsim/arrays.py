"""Arrays that stay as they are."""

import numpy as np


def readonly(array: np.ndarray) -> np.ndarray:
    """The values as C-ordered float64 that nobody can write to.

    Copies whatever somebody else could still change: a writable array, or a read-only view of one. An array that
    is read-only down to its memory is taken as it is, so a maker of large arrays may hand one over by clearing
    ``flags.writeable`` on the array that owns the memory.
    """
    out = np.ascontiguousarray(array, dtype=float)
    fresh = out is not array and out.base is None
    if not fresh and _changeable(out):
        out = out.copy()
    out.flags.writeable = False
    return out


def _changeable(array: np.ndarray) -> bool:
    """Whether the memory can be written through this array or through one that it is a view of."""
    owner: object = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return True
        owner = owner.base
    return owner is not None and not isinstance(owner, bytes)
