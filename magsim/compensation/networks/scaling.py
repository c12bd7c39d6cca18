"""Standardized inputs of networks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Standardizer:
    """Shift and scale of columns, known from the training rows alone.

    Attributes
    ----------
    mean, scale : (c,)
    """

    mean: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, matrices: Sequence[np.ndarray]) -> "Standardizer":
        """Return mean and standard deviation over the rows of all matrices; a constant column keeps scale 1."""
        matrix = np.concatenate(matrices)
        scale = matrix.std(axis=0)
        size = np.abs(matrix).max(axis=0)
        return cls(matrix.mean(axis=0), np.where(scale > 1e-12 * size, scale, 1.0))

    def __call__(self, matrix: np.ndarray) -> np.ndarray:
        """Return columns of about zero mean and unit deviation."""
        return (matrix - self.mean) / self.scale
