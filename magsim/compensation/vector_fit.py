"""Fit of the vector Tolles-Lawson model: residuals, their analytic Jacobian, and scipy's Levenberg-Marquardt on them.

    Ba(q)    = a + b B + c dB/dt [+ d d2B/dt2]
    clean(q) = |B - Ba(q)|
    r(q)     = [ bp(clean - reference) ;  w (clean - reference) ;  reg q ]

In band alone the fit can run to b = unit matrix: B - Ba goes to 0 and everything in band with it, a perfect fit of
nothing. The broadband term holds the length of what is left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from magsim.compensation.covariance import runs_of, spread_of
from magsim.compensation.solvers import Solution
from magsim.errors import DataError
from magsim.signals import EDGE_S, in_band, in_band_rows, median_step
from magsim.threads import one_blas_thread

SCALES = (100.0, 1e-3, 1e-3, 1e-4)
"""Sizes that make each unknown of order 1: of a [nT], b, c [s], d [s^2]."""

LABEL_WEIGHT = 0.02
"""Weight of the broadband term where the reference is the background itself."""

READING_WEIGHT = 1e-3
"""The same where the reference is the mean of the reading: 10 nT of geology, as in a field of 3 nT/km, then count as
0.01 nT in band, and a collapse as 45 nT (measured: 1e-4 to 1e-3 leave the same, 2e-2 five times as much)."""

REGULAR = 1e-3
"""Weight of the unknowns themselves."""

MOST_OFF = 0.02
"""How far the mean of the compensated reading may be from that of the reading, as a share."""

ROWS_PER_TERM = 10
"""Fewest rows in band for each coefficient."""

MOST_STEPS = 200


@dataclass(frozen=True)
class VectorRows:
    """Rows of one recording.

    Attributes
    ----------
    time_s : (m,) [s]
    vectors : tuple of (m, 3)
        B [nT], dB/dt [nT/s] and, where it is fitted, d2B/dt2 [nT/s^2], in the axes of the fluxgate.
    reference_nt : (m,) [nT]
        What the length of the clean field is compared with.
    """

    time_s: np.ndarray
    vectors: tuple[np.ndarray, ...]
    reference_nt: np.ndarray


@dataclass(frozen=True)
class VectorFit:
    """Fitted coefficients.

    Attributes
    ----------
    permanent_nt : (3,) [nT]
        a.
    matrices : (k, 3, 3)
        b, c [s] and, where it is fitted, d [s^2].
    residual_nt : float [nT]
        Root of the mean squared residual in band.
    covariance : (q, q)
        Of the coefficients in the order of ``permanent_nt`` and ``matrices``; empty before the fit is through.
    """

    permanent_nt: np.ndarray
    matrices: np.ndarray
    residual_nt: float
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def clean(self, vectors: Sequence[np.ndarray]) -> np.ndarray:
        """Return the length of the clean field, (m,) [nT]."""
        return _lengths(self.clean_vector(vectors))

    def clean_vector(self, vectors: Sequence[np.ndarray]) -> np.ndarray:
        """Return B - Ba, (m, 3) [nT]."""
        own = self.permanent_nt + sum(
            np.einsum("nj,ij->ni", vector, matrix) for vector, matrix in zip(vectors, self.matrices, strict=True)
        )
        return vectors[0] - own

    def parts(self, vectors: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the platform's field by source, (m, 3) [nT] each: permanent, then one for each matrix."""
        pairs = zip(vectors, self.matrices, strict=True)
        still = np.broadcast_to(self.permanent_nt, vectors[0].shape)
        return [still, *(np.einsum("nj,ij->ni", vector, matrix) for vector, matrix in pairs)]

    def slopes(self, vectors: Sequence[np.ndarray]) -> np.ndarray:
        """Return the derivatives of ``clean`` by the coefficients, (m, q)."""
        vector = self.clean_vector(vectors)
        direction = -vector / _lengths(vector)[:, None]
        blocks = [direction, *(np.einsum("ni,nj->nij", direction, each).reshape(-1, 9) for each in vectors)]
        return np.concatenate(blocks, axis=1)


def fit_vector(rows: Sequence[VectorRows], weight: float) -> VectorFit:
    """Fit the model.

    Parameters
    ----------
    rows : sequence of VectorRows
    weight : float
        Of the broadband term.

    Raises
    ------
    DataError
        If there are too few rows, the fit does not converge, or it collapses.
    """
    problem = VectorProblem(rows, weight)
    if problem.band_rows < ROWS_PER_TERM * problem.unknowns:
        msg = (
            f"a fit of {problem.unknowns} coefficients needs at least {ROWS_PER_TERM * problem.unknowns} training rows "
            f"after {EDGE_S:g} s at each end of each piece, and has {problem.band_rows}"
        )
        raise DataError(msg)
    start = np.zeros(problem.unknowns)
    with one_blas_thread():
        found = least_squares(
            problem.residuals, start, problem.jacobian, method="lm", max_nfev=MOST_STEPS, xtol=1e-10, ftol=1e-12
        )
    fit = replace(problem.fit_of(found.x), covariance=problem.covariance(found.x))
    _refuse_collapse(fit, rows)
    if not found.success:
        msg = f"the vector fit did not converge in {MOST_STEPS} steps; fit it to more maneuvers"
        raise DataError(msg)
    return fit


def _refuse_collapse(fit: VectorFit, rows: Sequence[VectorRows]) -> None:
    """Refuse a fit that makes the field vanish.

    Raises
    ------
    DataError
    """
    clean = np.concatenate([fit.clean(r.vectors) for r in rows]).mean()
    whole = np.concatenate([_lengths(r.vectors[0]) for r in rows]).mean()
    if abs(clean / whole - 1.0) > MOST_OFF:
        msg = (
            f"the vector fit takes {1.0 - clean / whole:.0%} of the field itself for interference, more than "
            f"{MOST_OFF:.0%}: the flight does not tell the two apart. Remedy: more maneuvers on more headings, or tl16"
        )
        raise DataError(msg)


class VectorProblem:
    """Residuals of scaled unknowns and their Jacobian.

    Parameters
    ----------
    rows : sequence of VectorRows
    weight : float
        Of the broadband term.
    """

    def __init__(self, rows: Sequence[VectorRows], weight: float) -> None:
        self._rows = rows
        self._weight = weight
        self._kinds = len(rows[0].vectors)
        self.unknowns = 3 + 9 * self._kinds
        self.band_rows = sum(len(in_band(r.reference_nt, r.time_s)) for r in rows)
        sizes = [SCALES[0]] * 3 + [size for size in SCALES[1 : 1 + self._kinds] for _ in range(9)]
        self._sizes = np.array(sizes)

    def fit_of(self, unknowns: np.ndarray) -> VectorFit:
        """Return the coefficients of scaled unknowns (q,)."""
        fit = self._fit(unknowns)
        band = [in_band(fit.clean(r.vectors) - r.reference_nt, r.time_s) for r in self._rows]
        return replace(fit, residual_nt=float(np.sqrt(np.mean(np.concatenate(band) ** 2))))

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """Return all residuals of scaled unknowns (q,)."""
        fit = self._fit(unknowns)
        parts = []
        for r in self._rows:
            off = fit.clean(r.vectors) - r.reference_nt
            parts += [in_band(off, r.time_s), self._weight * off]
        return np.concatenate([*parts, REGULAR * unknowns])

    def jacobian(self, unknowns: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residuals by the scaled unknowns, (rows, q)."""
        fit = self._fit(unknowns)
        parts = []
        for r in self._rows:
            slopes = self._slopes(fit, r)
            parts += [in_band(slopes, r.time_s), self._weight * slopes]
        return np.concatenate([*parts, REGULAR * np.eye(self.unknowns)])

    def covariance(self, unknowns: np.ndarray) -> np.ndarray:
        """Return the covariance of the coefficients at a solution, (q, q), from the noise that is left in band.

        That of linear fits (``magsim.compensation.covariance``) with the derivatives there as columns, turned to the
        principal axes of the fit: antisymmetric matrices hardly change the length, and would be lost in rounding.
        """
        fit = self._fit(unknowns)
        with one_blas_thread():
            _, singular, axes = np.linalg.svd(self.jacobian(unknowns), full_matrices=False)
            turned = axes.T / singular
            band = np.concatenate([in_band(self._slopes(fit, r) @ turned, r.time_s) for r in self._rows])
        left = np.concatenate([in_band(fit.clean(r.vectors) - r.reference_nt, r.time_s) for r in self._rows])
        runs = runs_of([r.time_s[in_band_rows(r.time_s)] for r in self._rows])
        nothing = np.zeros(self.unknowns)
        solution = Solution(nothing, 0.0, 1.0, fit.residual_nt, np.eye(self.unknowns), nothing)
        found = spread_of(solution, band, left, runs, 1.0 / median_step(self._rows[0].time_s)).covariance
        size = np.sqrt(np.mean(unknowns**2))
        with one_blas_thread():
            # what the weight of the unknowns shrinks may be as large as what was found
            lost = size * REGULAR**2 * turned @ turned.T
            scaled = turned @ found @ turned.T + lost @ lost.T
        return scaled * np.outer(self._sizes, self._sizes)

    def _fit(self, unknowns: np.ndarray) -> VectorFit:
        values = unknowns * self._sizes
        return VectorFit(values[:3], values[3:].reshape(self._kinds, 3, 3), float("nan"))

    def _slopes(self, fit: VectorFit, rows: VectorRows) -> np.ndarray:
        """Return d clean / d q, (m, q), of scaled unknowns: the clean direction n times - 1, B_j, dB_j/dt, ..."""
        return fit.slopes(rows.vectors) * self._sizes


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
