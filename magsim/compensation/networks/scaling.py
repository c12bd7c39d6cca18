"""Standardized inputs of networks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Moments:
    """Count, mean, variance and size of columns, of rows that are seen part by part.

    Parts are merged as Chan, Golub and LeVeque do (The American Statistician 37, 1983): no sum of squares, which would
    lose a deviation that is small beside the mean.

    Attributes
    ----------
    count : int
    mean, variance : (c,)
        The variance is that about the mean, divided by the count.
    size : (c,)
        Largest absolute value.
    """

    count: int
    mean: np.ndarray
    variance: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray) -> "Moments":
        """Return the moments of rows, (n, c) or (n,), of which there may be none."""
        matrix = values if values.ndim == 2 else values[:, None]
        if not len(matrix):
            zeros = np.zeros(matrix.shape[1])
            return cls(0, zeros, zeros, zeros)
        return cls(len(matrix), matrix.mean(axis=0), matrix.var(axis=0), np.abs(matrix).max(axis=0))

    def __add__(self, other: "Moments") -> "Moments":
        """Return the moments of the rows of both."""
        if not (self.count and other.count):
            return self if self.count else other
        count = self.count + other.count
        share, step = other.count / count, other.mean - self.mean
        variance = (1.0 - share) * self.variance + share * other.variance + share * (1.0 - share) * step**2
        return Moments(count, self.mean + share * step, variance, np.maximum(self.size, other.size))

    @property
    def standardizer(self) -> "Standardizer":
        """Mean and standard deviation; a constant column keeps scale 1."""
        scale = np.sqrt(self.variance)
        return Standardizer(self.mean, np.where(scale > 1e-12 * self.size, scale, 1.0))


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
        total = Moments.of(matrices[0])
        for matrix in matrices[1:]:
            total += Moments.of(matrix)
        return total.standardizer

    def __call__(self, matrix: np.ndarray) -> np.ndarray:
        """Return columns of about zero mean and unit deviation."""
        return (matrix - self.mean) / self.scale
