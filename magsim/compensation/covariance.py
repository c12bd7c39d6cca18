"""Errors of fitted coefficients where the rows are correlated, as they are in band.

A residual in 0.1 to 0.6 Hz at 10 Hz has about one independent row in ten, and the columns vary at the frequencies of
the maneuvers. So the covariance of the coefficients is the sandwich of the estimator around the autocovariance of the
residual (Newey and West, Econometrica 1987, 55, 703-708), which needs no single number of independent rows.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import fftconvolve

from magsim.compensation.solvers import Solution
from magsim.signals import spans
from magsim.threads import one_blas_thread

CORRELATION_S = 20.0
"""Lag up to which residuals may be correlated: two periods of the lower edge of the band [s]."""


class CoefficientSpread(NamedTuple):
    """How far coefficients may be off.

    Attributes
    ----------
    covariance : (c, c)
        Of the coefficients.
    effective_rows : float
        Independent rows that would tell as much about the coefficients as the correlated ones do.
    """

    covariance: np.ndarray
    effective_rows: float


def runs_of(times: Sequence[np.ndarray]) -> list[slice]:
    """Return the runs without a gap in the rows of recordings that follow each other.

    Parameters
    ----------
    times : sequence of (n,) [s]
        Times of the rows of each recording.
    """
    runs, start = [], 0
    for time_s in times:
        found = spans(time_s) if len(time_s) > 1 else [slice(0, len(time_s))]
        runs += [slice(start + span.start, start + span.stop) for span in found if span.stop > span.start]
        start += len(time_s)
    return runs


def autocovariance(residual: np.ndarray, runs: Sequence[slice], lags: int) -> np.ndarray:
    """Return the autocovariance of residuals, tapered from half of the lags on (Politis and Romano, 1995).

    Parameters
    ----------
    residual : (n, m)
        Of mean zero; the autocovariances of the columns are added up.
    runs : sequence of slice
        Rows without a gap; products never run across one.
    lags : int
        Largest lag [rows].

    Returns
    -------
    (lags + 1,) [unit of the residual, squared]
    """
    out = np.zeros(lags + 1)
    for run in runs:
        part = residual[run]
        most = min(lags, len(part) - 1)
        products = fftconvolve(part, part[::-1], axes=0)[len(part) - 1 : len(part) + most]
        out[: most + 1] += products.sum(axis=1)
    return out / len(residual) * np.minimum(1.0, 2.0 - 2.0 * np.arange(lags + 1) / (lags + 1))


def middle(matrix: np.ndarray, runs: Sequence[slice], covariance: np.ndarray) -> np.ndarray:
    """Return X^T C X for rows whose errors have a given autocovariance.

    Parameters
    ----------
    matrix : (n, c)
        X.
    runs : sequence of slice
    covariance : (lags + 1,)
        From lag 0 on.

    Returns
    -------
    (c, c)
    """
    kernel = np.concatenate([covariance[:0:-1], covariance])[:, None]
    lags = len(covariance) - 1
    out = np.zeros((matrix.shape[1], matrix.shape[1]))
    for run in runs:
        part = matrix[run]
        spread = fftconvolve(part, kernel, axes=0)[lags : lags + len(part)]
        with one_blas_thread():
            out += part.T @ spread
    return (out + out.T) / 2.0


def spread_of(
    solution: Solution, matrix: np.ndarray, target: np.ndarray, runs: Sequence[slice], rate_hz: float
) -> CoefficientSpread:
    """Return how far the coefficients of a fit may be off, from its residual.

    Parameters
    ----------
    solution : Solution
        Of ``matrix`` and ``target``.
    matrix : (n, c)
    target : (n,)
    runs : sequence of slice
        Rows without a gap.
    rate_hz : float [Hz]

    Notes
    -----
    With the gain G of the estimator, beta = G X^T y, the variance is G (X^T C X) G^T. C comes from the residual; what
    the fit took out of that, X times the error of beta, is added to its autocovariance in a second round. Where ridge
    or truncation shrinks, the mean squared shrinkage (I - G X^T X) P (I - G X^T X)^T of coefficients as large as those
    that were found is added.
    """
    residual = (target - np.einsum("nc,c->n", matrix, solution.coefficients))[:, None]
    lags = round(CORRELATION_S * rate_hz)
    left = autocovariance(residual, runs, lags)
    first = spread_for(solution, matrix, runs, left)
    taken = autocovariance(_times_root(matrix, first.covariance), runs, lags)
    found = spread_for(solution, matrix, runs, left + taken)
    with one_blas_thread():
        lost = (np.eye(matrix.shape[1]) - solution.gain @ (matrix.T @ matrix)) * solution.prior
        shrunk = lost @ lost.T
    return CoefficientSpread(found.covariance + (shrunk + shrunk.T) / 2.0, found.effective_rows)


def spread_for(solution: Solution, matrix: np.ndarray, runs: Sequence[slice], noise: np.ndarray) -> CoefficientSpread:
    """Return how far coefficients may be off for a given autocovariance of the noise; see ``spread_of``."""
    inner = middle(matrix, runs, noise)
    with one_blas_thread():
        covariance = solution.gain @ inner @ solution.gain.T
        slower = float(np.trace(solution.gain @ inner))
        white = float(np.trace(solution.gain @ (matrix.T @ matrix))) * noise[0]
    root = _root((covariance + covariance.T) / 2.0)
    with one_blas_thread():
        positive = root @ root.T
    rows = len(matrix) * white / slower if slower > 0.0 else float(len(matrix))
    return CoefficientSpread((positive + positive.T) / 2.0, rows)


def _root(covariance: np.ndarray) -> np.ndarray:
    """Return R with R R^T the covariance, without what a taper may have left of negative variance, (c, c)."""
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    with one_blas_thread():
        variance, axes = np.linalg.eigh(covariance / np.outer(size, size))
    return size[:, None] * axes * np.sqrt(np.maximum(variance, 0.0))


def _times_root(matrix: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    with one_blas_thread():
        return matrix @ _root(covariance)
