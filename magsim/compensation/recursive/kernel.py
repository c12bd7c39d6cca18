"""Recursive least squares about a fitted answer, compiled: one row after the other, with bounded memory.

All arrays are changed in place. The c columns are scaled to unit deviation in band; the reading is one channel more.
"""

import math

import numpy as np

from magsim.storage.compiled import compiled


@compiled
def filtered(sos: np.ndarray, states: np.ndarray, channels: np.ndarray) -> None:
    """Pass one row of channels through second-order sections (transposed direct form II).

    Parameters
    ----------
    sos : (k, 6)
    states : (k, 2, c)
    channels : (c,)
        Values before, and after.
    """
    for section in range(len(sos)):
        b0, b1, b2, _, a1, a2 = sos[section]
        for i in range(len(channels)):
            x = channels[i]
            y = b0 * x + states[section, 0, i]
            states[section, 0, i] = b1 * x - a1 * y + states[section, 1, i]
            states[section, 1, i] = b2 * x - a2 * y
            channels[i] = y


@compiled
def solved(matrix: np.ndarray, right: np.ndarray, lower: np.ndarray, out: np.ndarray) -> None:
    """Solve a symmetric positive definite system by Cholesky's decomposition.

    Parameters
    ----------
    matrix : (c, c)
        Of which the lower triangle is read.
    right : (c,)
    lower : (c, c)
        Room for the decomposition.
    out : (c,)
    """
    count = len(right)
    for j in range(count):
        for i in range(j, count):
            total = matrix[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            lower[i, j] = math.sqrt(total) if i == j else total / lower[j, j]
    for i in range(count):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]
    for i in range(count - 1, -1, -1):
        total = out[i]
        for k in range(i + 1, count):
            total -= lower[k, i] * out[k]
        out[i] = total / lower[i, i]


@compiled
def updated(
    anchor: np.ndarray,
    information: np.ndarray,
    right: np.ndarray,
    row: np.ndarray,
    misfit: float,
    keep: float,
    limit: float,
    change: np.ndarray,
    lower: np.ndarray,
) -> float:
    """Take one row of filtered columns: forget a little, add it, and solve for the change of the coefficients.

    Parameters
    ----------
    anchor : (c, c)
        What the fit knows and is never forgotten: the weight of no change.
    information : (c, c)
        Weighted sum of products of rows; the lower triangle is used.
    right : (c,)
        Weighted sum of rows times misfits.
    row : (c,)
    misfit : float [nT]
        Of the fitted answer: filtered reading minus filtered columns times fitted coefficients.
    keep : float
        Share of the past that is kept in a row.
    limit : float [nT]
        Error of the present answer beyond which a row counts less, as 1 / error^2: what is far off hardly counts.
    change : (c,)
        Of the coefficients.
    lower : (c, c)
        Room.
    """
    count = len(row)
    error = misfit
    for i in range(count):
        error -= row[i] * change[i]
    weight = 1.0 if abs(error) <= limit else (limit / abs(error)) ** 2
    for i in range(count):
        right[i] = keep * right[i] + weight * misfit * row[i]
        for j in range(i + 1):
            information[i, j] = keep * information[i, j] + weight * row[i] * row[j]
            lower[i, j] = anchor[i, j] + information[i, j]
    solved(lower, right, lower, change)
    return error
