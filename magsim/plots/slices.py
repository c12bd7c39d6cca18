"""A plane with values, for pictures."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Slice:
    """A plane with a value at each place.

    Attributes
    ----------
    title : str
    across, up : (m,), (n,) [m]
        Places along the two axes of the picture.
    values : (m, n) [nT]
        NaN where no sensor can be.
    axes : tuple of int
        Numbers of the body axes that ``across`` and ``up`` are.
    """

    title: str
    across: np.ndarray
    up: np.ndarray
    values: np.ndarray
    axes: tuple[int, int]
