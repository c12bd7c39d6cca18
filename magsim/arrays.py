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


def frozen(array: np.ndarray) -> np.ndarray:
    """Return values as they lie where nothing can write to them, else as ``readonly`` returns them."""
    return array if _is_immutable(array) else readonly(array)


def given_up(array: np.ndarray) -> np.ndarray:
    """Return an array as it lies in memory, without a copy, so that it cannot be written to any more.

    Setting ``flags.writeable`` is an error, as for ``readonly``. The caller gives up the array and every view of it.
    """
    if _is_immutable(array) or not array.size:
        return array
    owner = array
    while isinstance(owner.base, np.ndarray):
        owner = owner.base
    whole = np.frombuffer(memoryview(owner.ravel(order="K").data).toreadonly(), dtype=owner.dtype)
    start = array.__array_interface__["data"][0] - owner.__array_interface__["data"][0]
    return np.ndarray(array.shape, dtype=array.dtype, buffer=whole, offset=start, strides=array.strides)


def _is_immutable(array: np.ndarray) -> bool:
    """Whether the array lies in a ``bytes`` object, or in memory that was given up."""
    owner: object = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    return isinstance(owner, bytes) or (isinstance(owner, memoryview) and owner.readonly)
