"""How far pairs of rows at one place are to be believed beside the equations in band."""

import numpy as np

from magsim.compensation.targets.pairs import Pairs
from magsim.threads import one_blas_thread

WEIGHTS = 10.0 ** np.arange(-3.0, 2.01, 0.25)
"""Candidates: weight of all pairs beside all rows in band."""

ABOUT_AS_GOOD = 1.02
"""How much worse than the best a deviation may be and still count as about as good: the smaller weight is taken."""


def weight_of_pairs(pairs: Pairs, band: tuple[np.ndarray, np.ndarray], crossed: tuple[np.ndarray, np.ndarray]) -> float:
    """Return what the rows of pairs are multiplied with before they join those in band.

    It is the weight with which pairs that are left out are foretold best by the others. The two kinds of equations
    cannot be weighted by what they leave: that of the band is mostly no noise but what the columns cannot express, so
    that thousands of rows agree on coefficients that are wrong.

    Parameters
    ----------
    pairs : Pairs
    band : (n, c) and (n,) [nT]
        Columns and target in band.
    crossed : (p, c) and (p,) [nT]
        Differences of columns and target, without drift.

    Returns
    -------
    float

    Notes
    -----
    A pair that is left out of a linear fit is missed by ``r / (1 - h)``, with its residual ``r`` and its leverage ``h``
    (Allen, Technometrics 1974, 16, 125-127); the leverage counts the drift, which is fitted too.
    """
    (matrix, target), (apart, wanted) = band, crossed
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    rows, drift = len(matrix) / len(apart), np.einsum("pk,pk->p", pairs.drift, pairs.drift)
    missed = []
    with one_blas_thread():
        scaled, beside = matrix / scale, apart / scale
        square, product = scaled.T @ scaled, scaled.T @ target
        # a little of the unit matrix: exact dependencies of the columns must not be divided by
        square[np.diag_indices_from(square)] += 1e-10 * np.trace(square)
        for weight in rows * WEIGHTS**2:
            inverse = np.linalg.inv(square + weight * beside.T @ beside)
            left = wanted - beside @ (inverse @ (product + weight * beside.T @ wanted))
            leverage = drift + weight * np.einsum("pc,cd,pd->p", beside, inverse, beside)
            missed.append(float(np.sqrt(np.mean((left / np.maximum(1.0 - leverage, 1e-6)) ** 2))))
    good = np.array(missed) <= ABOUT_AS_GOOD * min(missed)
    return float(np.sqrt(rows) * WEIGHTS[int(np.argmax(good))])
