"""How large the terms of the Earth's field may be in a fit: as large as the slow course of the reading says.

In band the terms of the position are small and alike: on the straight legs of an airplane they move in its turns alone,
where Tolles-Lawson is worst. Free, they take its errors: -1830 nT from the middle to the edge of a box of 13 km whose
field changes by 17 nT. But the same field is in the reading below the band too, where it is large. A fit of its slow
course by the same terms gives their size, and that is the prior of the fit in band: rows beside the equations, one for
each term, as a reading of zero with that size as its error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from magsim.compensation.columns import Design, PositionColumns
from magsim.compensation.solvers import Solution, Solver, least_squares
from magsim.signals import BAND_HZ


def rows_as_one(rate_hz: float) -> float:
    """Return how many rows of band-passed white noise tell as much as one independent row: 10 at 10 Hz.

    A band of width W carries 2 W independent values a second (Nyquist; Shannon, Proc. IRE 1949, 37, 10-21).
    """
    return max(1.0, rate_hz / (2.0 * (BAND_HZ[1] - BAND_HZ[0])))


def solve_with_prior(
    solve: Solver, matrix: np.ndarray, target: np.ndarray, sizes: np.ndarray, rate_hz: float
) -> Solution:
    """Solve with a Gaussian prior of mean zero on some coefficients.

    Parameters
    ----------
    solve : Solver
    matrix : (n, c)
        Band-passed columns.
    target : (n,) [nT]
    sizes : (c,)
        Standard deviation of the prior; infinite where there is none.
    rate_hz : float
        Rows a second.

    Returns
    -------
    Solution
        Its residual is that of the given rows.

    Notes
    -----
    Maximum a posteriori: |y - X b|^2 / (k s^2) + sum (b_i / size_i)^2, with k rows counted as one and s the residual of
    the fit without a prior.
    """
    free = solve(matrix, target)
    held = np.flatnonzero(np.isfinite(sizes) & (sizes > 0.0))
    rows = np.zeros((len(held), matrix.shape[1]))
    rows[np.arange(len(held)), held] = free.residual_std * np.sqrt(rows_as_one(rate_hz)) / sizes[held]
    found = solve(np.vstack([matrix, rows]), np.concatenate([target, np.zeros(len(held))]))
    rest = target - np.einsum("nc,c->n", matrix, found.coefficients)
    prior = np.where(np.isfinite(sizes), sizes, found.prior)
    return replace(found, residual_std=float(np.sqrt(np.mean(rest**2))), prior=prior)


def sizes_of_terms(
    field: PositionColumns, designs: Sequence[Design], targets: Sequence[np.ndarray], coefficients: np.ndarray
) -> np.ndarray:
    """Return the size of the horizontal terms that the slow course of the reading shows.

    Parameters
    ----------
    field : PositionColumns
    designs : sequence of Design
        Columns of the platform over all rows with a reading, unfiltered.
    targets : sequence of (n,) [nT]
    coefficients : (c,)
        Of the platform, from a fit without horizontal terms.

    Returns
    -------
    (g,) [nT]
        For each column of the field: the root of the mean square of the terms of its place; infinite for the height.
    """
    tables = []
    for beside, design, values in zip(field.designs, designs, targets, strict=True):
        table = np.column_stack([beside.matrix, values - np.einsum("nc,c->n", design.matrix, coefficients)])
        tables.append(table - table.mean(axis=0))
    slow = np.concatenate(tables)
    terms = least_squares(slow[:, :-1], slow[:, -1]).coefficients
    sizes = np.full(len(field.horizontal), np.inf)
    for place in range(len(field.areas)):
        here = field.horizontal == place
        sizes[here] = np.sqrt(np.mean(terms[here] ** 2))
    return sizes
