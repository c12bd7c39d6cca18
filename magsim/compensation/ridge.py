"""Ridge regression on scaled columns, its weight chosen by generalized cross-validation."""

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

LAMBDAS = 10.0 ** (0.5 * np.arange(-28, 5))
"""Weights that are tried, relative to the largest squared singular value: 1e-14 to 1e2 in half decades."""


@dataclass(frozen=True)
class RidgeFit:
    """Result of a ridge regression.

    Attributes
    ----------
    coefficients : (c,)
        For the columns as they were given.
    weight : float
        Chosen ridge weight, relative to the largest squared singular value of the scaled columns.
    condition : float
        Ratio of the largest to the smallest singular value of the scaled columns; infinite where the smallest is 0.
    residual_std : float
        Root of the mean squared residual, in the unit of the target.
    """

    coefficients: np.ndarray
    weight: float
    condition: float
    residual_std: float


def fit_ridge(matrix: np.ndarray, target: np.ndarray) -> RidgeFit:
    """Ridge regression of a target on columns, both of zero mean (band-passed or centered).

    The columns are scaled to unit deviation first: a weight on unscaled columns shrinks the answer to nothing.
    Everything is pinned to one BLAS thread, so that the bits do not depend on the number of threads.

    Parameters
    ----------
    matrix : (n, c)
    target : (n,)

    Notes
    -----
    With A = U S V^T the scaled columns, f_i = S_i^2 / (S_i^2 + lambda S_1^2) and beta = V diag(f_i / S_i) U^T y;
    GCV(lambda) = (RSS / n) / (1 - sum f_i / n)^2 (Golub, Heath and Wahba, Technometrics 1979, 21, 215-223).
    """
    rows = len(target)
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    with threadpool_limits(limits=1):
        left, singular, right = np.linalg.svd(matrix / scale, full_matrices=False)
        projected = left.T @ target
        # What numerical noise leaves of an exact dependency must not be divided by.
        kept = singular > rows * np.finfo(float).eps * singular[0]
        inverse = np.where(kept, 1.0 / np.where(kept, singular, 1.0), 0.0)
        outside = max(float(target @ target - projected @ projected), 0.0)
        scores = []
        for weight in LAMBDAS:
            factors = kept * singular**2 / (singular**2 + weight * singular[0] ** 2)
            rest = outside + float(np.sum(((1.0 - factors) * projected) ** 2))
            scores.append((rest / rows) / (1.0 - factors.sum() / rows) ** 2)
        weight = float(LAMBDAS[int(np.argmin(scores))])
        factors = kept * singular**2 / (singular**2 + weight * singular[0] ** 2)
        coefficients = right.T @ (factors * inverse * projected) / scale
        rest = outside + float(np.sum(((1.0 - factors) * projected) ** 2))
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else float("inf")
    return RidgeFit(coefficients, weight, condition, float(np.sqrt(rest / rows)))
