"""Solvers of linear fits: least squares, ridge regression, truncated singular values and principal components.

All scale the columns to unit deviation first (a weight on unscaled columns shrinks the answer to nothing) and work on
one singular value decomposition, A = U S V^T of the scaled columns. They run on one BLAS thread, so that the bits do
not depend on the number of threads.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magsim.threads import one_blas_thread

LAMBDAS = 10.0 ** (0.5 * np.arange(-28, 5))
"""Ridge weights that are tried, relative to the largest squared singular value: 1e-14 to 1e2 in half decades."""


SHARE = 0.9999
"""Share of the variance of the columns that principal components keep by default (an estimate)."""


@dataclass(frozen=True)
class Solution:
    """Result of a linear fit.

    Attributes
    ----------
    coefficients : (c,)
        For the columns as they were given.
    weight : float
        Ridge weight, relative to the largest squared singular value of the scaled columns; 0 without ridge.
    condition : float
        Ratio of the largest to the smallest singular value of the scaled columns; infinite where the smallest is 0.
    residual_std : float
        Root of the mean squared residual, in the unit of the target.
    gain : (c, c)
        G of the estimate G X^T y, for the columns X as they were given.
    prior : (c,)
        Size of a coefficient that the fit would not notice: as large in the target as those that were found are in the
        root of the mean square. Errors of what ridge or truncation shrinks are taken from it.
    """

    coefficients: np.ndarray
    weight: float
    condition: float
    residual_std: float
    gain: np.ndarray
    prior: np.ndarray


Solver = Callable[[np.ndarray, np.ndarray], Solution]
"""Maps columns (n, c) and a target (n,), both of zero mean (band-passed or centered), to a ``Solution``."""


@dataclass(frozen=True)
class _Decomposition:
    """Scaled columns as U S V^T, with the target in U.

    Attributes
    ----------
    rows : int
    scale : (c,)
        Deviations of the columns.
    singular : (c,)
        S, falling.
    right : (c, c)
        V^T.
    projected : (c,)
        U^T y.
    outside : float
        Squared length of what no column reaches.
    kept : (c,) bool
        Singular values above numerical noise: what that leaves of an exact dependency must not be divided by.
    """

    rows: int
    scale: np.ndarray
    singular: np.ndarray
    right: np.ndarray
    projected: np.ndarray
    outside: float
    kept: np.ndarray

    @classmethod
    def of(cls, matrix: np.ndarray, target: np.ndarray) -> "_Decomposition":
        """Decompose columns (n, c) for a target (n,)."""
        rows = len(target)
        scale = np.sqrt(np.mean(matrix**2, axis=0))
        scale = np.where(scale > 0.0, scale, 1.0)
        with one_blas_thread():
            left, singular, right = np.linalg.svd(matrix / scale, full_matrices=False)
            projected = left.T @ target
            outside = max(float(target @ target - projected @ projected), 0.0)
        kept = singular > rows * np.finfo(float).eps * singular[0]
        return cls(rows, scale, singular, right, projected, outside, kept)

    def rest(self, factors: np.ndarray) -> np.ndarray:
        """Return the squared length of the residual for filter factors (..., c)."""
        return self.outside + np.sum(((1.0 - factors) * self.projected) ** 2, axis=-1)

    def gcv(self, factors: np.ndarray) -> np.ndarray:
        """Return the score of generalized cross-validation for filter factors (m, c)."""
        return (self.rest(factors) / self.rows) / (1.0 - factors.sum(axis=-1) / self.rows) ** 2

    def solution(self, factors: np.ndarray, weight: float = 0.0) -> Solution:
        """Return the coefficients for filter factors (c,): beta = V diag(f_i / S_i) U^T y, unscaled."""
        inverse = np.where(self.kept, 1.0 / np.where(self.kept, self.singular, 1.0), 0.0)
        with one_blas_thread():
            scaled = self.right.T @ (factors * inverse * self.projected)
            gain = (self.right.T * (factors * inverse**2)) @ self.right / np.outer(self.scale, self.scale)
        smallest = self.singular[-1]
        condition = float(self.singular[0] / smallest) if smallest > 0.0 else float("inf")
        size = float(np.sqrt(np.mean(scaled**2)))
        residual_std = float(np.sqrt(self.rest(factors) / self.rows))
        return Solution(scaled / self.scale, weight, condition, residual_std, gain, size / self.scale)


def least_squares(matrix: np.ndarray, target: np.ndarray) -> Solution:
    """Solve by plain least squares; of an exact dependency the shortest answer.

    Parameters
    ----------
    matrix : (n, c)
    target : (n,)
    """
    found = _Decomposition.of(matrix, target)
    return found.solution(found.kept.astype(float))


def ridge(matrix: np.ndarray, target: np.ndarray) -> Solution:
    """Solve by ridge regression, its weight chosen by generalized cross-validation.

    Parameters
    ----------
    matrix : (n, c)
    target : (n,)

    Notes
    -----
    With f_i = S_i^2 / (S_i^2 + lambda S_1^2) and beta = V diag(f_i / S_i) U^T y;
    GCV(lambda) = (RSS / n) / (1 - sum f_i / n)^2 (Golub, Heath and Wahba, Technometrics 1979, 21, 215-223).
    """
    found = _Decomposition.of(matrix, target)
    squared = found.singular**2
    factors = found.kept * squared / (squared + LAMBDAS[:, None] * squared[0])
    best = int(np.argmin(found.gcv(factors)))
    return found.solution(factors[best], float(LAMBDAS[best]))


def truncated_svd(matrix: np.ndarray, target: np.ndarray) -> Solution:
    """Solve with the largest singular values alone, as many as generalized cross-validation finds best.

    Parameters
    ----------
    matrix : (n, c)
    target : (n,)

    Notes
    -----
    f_i is 1 for the first k singular values, else 0, and GCV as in ``ridge`` (Hansen, Rank-Deficient and Discrete
    Ill-Posed Problems, SIAM 1998, section 7.4).
    """
    found = _Decomposition.of(matrix, target)
    count = len(found.singular)
    factors = np.tri(count) * found.kept
    return found.solution(factors[int(np.argmin(found.gcv(factors)))])


def principal_components(matrix: np.ndarray, target: np.ndarray, share: float = SHARE) -> Solution:
    """Solve with the principal components of the scaled columns that hold a share of their variance.

    Parameters
    ----------
    matrix : (n, c)
    target : (n,)
    share : float
        Of the sum of the squared singular values, from 0 to 1; the fewest components that reach it are kept.

    Notes
    -----
    Regression on components is truncation of singular values (Jolliffe, Principal Component Analysis, 2002, section
    8.1); ``truncated_svd`` chooses their number by what they explain of the target.
    """
    found = _Decomposition.of(matrix, target)
    held = np.cumsum(found.singular**2)
    count = int(np.searchsorted(held, share * held[-1] * (1.0 - 1e-12))) + 1
    return found.solution((np.arange(len(held)) < count) * found.kept.astype(float))


SOLVERS: dict[str, Solver] = {
    "ridge": ridge,
    "least_squares": least_squares,
    "truncated_svd": truncated_svd,
    "principal_components": principal_components,
}
"""Solvers by name."""
