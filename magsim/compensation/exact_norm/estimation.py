"""Maximum a posteriori coefficients of the exact norm, and how large each group of them is.

The interference is |B + X P| - |B|: B the background, X the signals, P what they do to the field. It is nearly linear
in P, so some Gauss-Newton steps find it. Each group of signals has a deviation of its own that is found from the
training rows (automatic relevance determination: MacKay, Neural Computation 1992, 4, 415-447): a group that explains
nothing shrinks to nothing and costs nothing. The noise comes from the residual, its rows counted as what the band
leaves independent; rows beyond some deviations count less (Huber).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from magsim.compensation.exact_norm.sources import Driven, Shape, Signal
from magsim.compensation.reduction import Reduction
from magsim.compensation.targets import Pairs, weight_of_pairs
from magsim.threads import one_blas_thread

DAY_NT = 1.0
"""Deviation of what magnets are from one training flight to the next [nT] (estimate: 0.2 % of some hundred nT)."""

LATER_S = 0.05
"""Deviation of what the scalar magnetometer lags behind the INS [s] (estimate)."""

BENT = np.array([0.4, 0.4, 0.4, 0.2])
"""Deviations of the logarithms of the half widths of the memory, known to a factor of one and a half, and of what of it
comes late (estimates)."""

_TOLD = 1.0
"""Each of them is fitted if its deviation makes so many times the residual: it makes 25 to 85 pT where there is a
memory, 0.1 and less where there is none (tuning sets)."""

TENSORS = ("induced", "eddy", "eddy lag", "memory")
"""Groups with a matrix."""

TRACE = 0.003
"""Deviation of the mean of a matrix's diagonal in a fit without labels: so much of an anomaly may be lost."""

_HUBER = 4.0
_ALIKE = 0.3
"""Flights whose weights differ by no more than this count the same."""

_ROUNDS = 40
_CLOSE = 0.01
_DOUBT = 1.0
"""Coefficients of nothing that a group counts beside its own: one that explains little shrinks to nothing."""

_LAGS = 60
_SMALLEST = 1e-4
"""A group may shrink to so much of its size before any flight."""

_QUIET_NT = 1e-4
"""Least noise: what is fitted to noise-free labels is not exact either [nT]."""


class FlightRows(NamedTuple):
    """What is fitted of one training recording.

    Attributes
    ----------
    driven : Driven
    target : (n,) [nT]
    beside : (n, e)
        Columns of the Earth's field, fitted beside the sources and never subtracted.
    derivative : callable
        Returns the derivative of a series of its rows by time, (n,).
    """

    driven: Driven
    target: np.ndarray
    beside: np.ndarray
    derivative: Callable[[np.ndarray], np.ndarray]


class Step(NamedTuple):
    """The solution of the problem made linear.

    Attributes
    ----------
    coefficients : (k, 3)
    shape : Shape
    bent_nt : float [nT]
        How much the change of the memory is in the band, rms.
    """

    coefficients: np.ndarray
    shape: Shape
    bent_nt: float


@dataclass(frozen=True, eq=False)
class Estimated:
    """What was found.

    Attributes
    ----------
    coefficients : (k, 3)
        In the units of the signals.
    root : (3 k, m)
        Its product with its transpose is the covariance of ``coefficients.ravel()``. Coefficients that no flight tells
        apart have errors of hundreds of nT which cancel in the interference: only a root keeps that.
    shape : Shape
    noise_nt : float [nT]
        Deviation of the residual in band.
    free : float
        Number of coefficients that the rows determine.
    shrunk : (k,)
        What each group's deviation became, over its size before any flight.
    """

    coefficients: np.ndarray
    root: np.ndarray
    shape: Shape
    noise_nt: float
    free: float
    shrunk: np.ndarray

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the coefficients, (k, 3)."""
        return np.sqrt(np.einsum("cm,cm->c", self.root, self.root)).reshape(-1, 3)


def exact_interference(driven: Driven, coefficients: np.ndarray) -> np.ndarray:
    """Return |B + X P| - |B|, (n,) [nT]."""
    own, along = _along(driven, coefficients)
    return np.einsum("ni,ni->n", own, along)


def shares_of(driven: Driven, coefficients: np.ndarray) -> np.ndarray:
    """Return what each signal adds to the interference, (n, k) [nT]; the sum is exact.

    |T| - |B| = (T - B) . (T + B) / (|T| + |B|), and T - B is the sum over the signals.
    """
    _, along = _along(driven, coefficients)
    with one_blas_thread():
        return driven.signals * (along @ coefficients.T)


def _along(driven: Driven, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the field of the sources and (T + B) / (|T| + |B|), each (n, 3)."""
    with one_blas_thread():
        own = driven.signals @ coefficients
    background, total = driven.background, driven.background + own
    lengths = np.sqrt(np.einsum("ni,ni->n", total, total)) + np.sqrt(np.einsum("ni,ni->n", background, background))
    return own, (total + background) / lengths[:, None]


def jacobian_of(driven: Driven, coefficients: np.ndarray) -> np.ndarray:
    """Return the derivative of the interference by ``coefficients.ravel()``, (n, 3 k)."""
    return _jacobian_lines(driven, coefficients).T


def _jacobian_lines(driven: Driven, coefficients: np.ndarray) -> np.ndarray:
    """Return the same with a coefficient in each line, (3 k, n)."""
    with one_blas_thread():
        total = driven.background + driven.signals @ coefficients
    unit = total.T / np.sqrt(np.einsum("ni,ni->n", total, total))
    return (np.ascontiguousarray(driven.signals.T)[:, None, :] * unit).reshape(-1, len(total))


class Estimation:
    """Gauss-Newton steps of one fit.

    Parameters
    ----------
    table : sequence of Signal
    reduction : Reduction
        Of the training rows, to the band of compensation.
    pairs : Pairs, optional
        Rows at one place, where the clean field agrees.
    tied : bool
        Hold the traces of the matrices of induced, eddy and remembered fields near zero. A trace makes a share of the
        background's strength, and a fit without labels finds geology in the reading that such a share explains.
    """

    def __init__(
        self, table: Sequence[Signal], reduction: Reduction, pairs: Pairs | None = None, *, tied: bool = False
    ) -> None:
        self.reduction, self.pairs = reduction, pairs
        self.size = np.array([signal.size for signal in table]).repeat(3)
        groups = list(dict.fromkeys(signal.group for signal in table))
        self.group = np.array([groups.index(signal.group) for signal in table]).repeat(3)
        self.shrunk = np.ones(len(groups))
        self.ties = _ties(table) if tied else np.zeros((0, self.size.size))
        self.memory = [number for number, signal in enumerate(table) if signal.group == "memory"]
        self.noise_nt, self.per_row = 0.1, reduction.per_row

    def step(self, flights: Sequence[FlightRows], at: np.ndarray, shape: Shape, *, size_groups: bool) -> Step:
        """Return the solution of the problem made linear.

        Parameters
        ----------
        flights : sequence of FlightRows
        at : (k, 3)
            Coefficients where it is made linear.
        shape : Shape
            That of the signals of the flights.
        size_groups : bool
            Whether the deviations of the groups are found, or left as they are.
        """
        matrix, rest = self._equations(flights, at)
        size = np.append(BENT[: len(shape.bent)], LATER_S)
        own, days = at.size, matrix.shape[1] - at.size - len(size)
        matrix *= np.concatenate([self.size, np.full(days, DAY_NT), size])
        start = np.concatenate([at.ravel() / self.size, np.zeros(days), np.append(shape.bent, shape.later_s) / size])
        bent = matrix[:, own + days : -1]
        is_told = np.sqrt(np.mean(bent**2, axis=0)) > _TOLD * self.noise_nt
        bent *= is_told
        with one_blas_thread():
            found = self._solve(matrix, rest + matrix @ start, size_groups=size_groups)
            moved = bent @ (found - start)[own + days : -1]
        reshaped = np.where(is_told, found[own + days : -1] * size[:-1], shape.bent)
        self._shape = Shape(tuple(reshaped.tolist()), float(found[-1] * LATER_S))
        return Step((found[:own] * self.size).reshape(-1, 3), self._shape, float(np.sqrt(np.mean(moved**2))))

    def settled(self) -> Estimated:
        """Return the solution of the last step, with its errors."""
        own, upper = len(self.size), self._upper[:-1, :-1]
        with one_blas_thread():
            root = solve_triangular(upper, np.eye(len(upper)))
            found = root @ self._upper[:-1, -1]
        return Estimated(
            (found[:own] * self.size).reshape(-1, 3),
            root[:own] * self.size[:, None],
            self._shape,
            self.noise_nt,
            self.free,
            self.shrunk[self.group][::3].copy(),
        )

    def _equations(self, flights: Sequence[FlightRows], at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return reduced columns (sources, days, memory, lag), and the reduced rest."""
        own, beside, days = at.size, flights[0].beside.shape[1], 3 * (len(flights) - 1)
        contrasts = _contrasts(len(flights))
        tables = []
        for number, flight in enumerate(flights):
            now = exact_interference(flight.driven, at)
            jacobian = _jacobian_lines(flight.driven, at)
            # the first signal is constant: its columns are the direction of the field
            of_day = np.kron(contrasts[number][:, None], jacobian[:3])
            # what another memory adds, along the total field
            pull = at[self.memory] @ jacobian[:3]
            bent = np.array([(slopes * pull).sum(axis=0) for slopes in flight.driven.bends]).reshape(-1, len(now))
            rate, rest = flight.derivative(now), flight.target - now
            tables.append(np.vstack([jacobian, of_day, flight.beside.T, bent, rate, rest]))
        reduced = self.reduction(tables)
        extra = slice(own + days, own + days + beside)
        kept = np.delete(reduced, extra, axis=1)
        if beside:
            with one_blas_thread():
                basis = np.linalg.qr(reduced[:, extra])[0]
                kept -= basis @ (basis.T @ kept)
        if self.pairs is not None:
            kept = np.vstack([kept, self._crossed(kept, [np.delete(table, extra, axis=0).T for table in tables])])
        return kept[:, :-1], kept[:, -1]

    def _crossed(self, band: np.ndarray, tables: Sequence[np.ndarray]) -> np.ndarray:
        """Return the equations of pairs of rows, weighted."""
        assert self.pairs is not None
        apart = self.pairs.differences([table[:, :-1] for table in tables])
        wanted = self.pairs.target([table[:, -1] for table in tables])
        weight = weight_of_pairs(self.pairs, (band[:, :-1], band[:, -1]), (apart, wanted))
        return weight * np.column_stack([apart, wanted])

    def _solve(self, matrix: np.ndarray, target: np.ndarray, *, size_groups: bool) -> np.ndarray:
        """Return scaled coefficients; noise, groups and weights settle on the way."""
        rows, per_row = len(target), self.per_row
        own = len(self.group)
        ties = np.zeros((len(self.ties), matrix.shape[1]))
        ties[:, :own] = self.ties
        weights = np.ones(rows)
        normal, right, square = matrix.T @ matrix, matrix.T @ target, target @ target
        for number in range(_ROUNDS):
            before = self.noise_nt, self.shrunk.copy()
            prior = self._prior(matrix.shape[1])
            inverse = _inverse(normal / (per_row * self.noise_nt**2) + np.diag(prior) + ties.T @ ties)
            found = inverse @ right / (per_row * self.noise_nt**2)
            left = max(square - 2.0 * found @ right + found @ normal @ found, 0.0)
            known = np.maximum(1.0 - prior * np.diag(inverse), 0.0)
            self.free = float(known.sum())
            independent = rows / per_row
            loss = max(1.0 - self.free / independent, 0.3)
            self.noise_nt = max(float(np.sqrt(left / weights.sum() / loss)), _QUIET_NT)
            if size_groups:
                self._resize(found[:own], known[:own])
            change = max(abs(np.log(self.noise_nt / before[0])), float(np.abs(np.log(self.shrunk / before[1])).max()))
            if change < _CLOSE:
                break
            if number == 2:
                weights = self._weights(target - matrix @ found)
                if (weights != 1.0).any():
                    weighted = matrix * weights[:, None]
                    normal, right, square = weighted.T @ matrix, weighted.T @ target, (weights * target) @ target
        # the normal equations have lost what the weakest directions need
        equations = np.zeros((rows + matrix.shape[1] + len(ties), matrix.shape[1] + 1))
        equations[:rows, :-1], equations[:rows, -1] = matrix, target
        equations[:rows] *= (np.sqrt(weights / per_row) / self.noise_nt)[:, None]
        np.fill_diagonal(equations[rows : rows + matrix.shape[1]], np.sqrt(self._prior(matrix.shape[1])))
        equations[rows + matrix.shape[1] :, :-1] = ties
        self._upper = np.asarray(np.linalg.qr(equations, mode="r"))
        found = solve_triangular(self._upper[:-1, :-1], self._upper[:-1, -1])
        self.per_row = max(_rows_for_one(target - matrix @ found), self.reduction.per_row)
        return found

    def _weights(self, residual: np.ndarray) -> np.ndarray:
        """Return what each row counts: flights by their own noise, and outliers of a flight less (Huber)."""
        number = np.full(len(residual), -1)
        number[: self.reduction.rows] = self.reduction.of_table()
        weights = np.ones(len(residual))
        for one in np.unique(number):
            rows = number == one
            noise = max(float(np.sqrt(np.mean(residual[rows] ** 2))), _QUIET_NT)
            outlying = _HUBER * noise / np.maximum(np.abs(residual[rows]), 1e-300)
            # pairs of rows have a weight already
            weights[rows] = np.minimum(1.0, outlying) / noise**2 if one >= 0 else 1.0 / self.noise_nt**2
        # a difference that chance makes between two flights is none
        weights *= len(weights) / weights.sum()
        return np.where(np.abs(weights - 1.0) < _ALIKE, 1.0, weights)

    def _prior(self, count: int) -> np.ndarray:
        """Return the inverse variances of the scaled unknowns: sources, then days, memory and lag."""
        prior = np.ones(count)
        prior[: len(self.group)] = self.shrunk[self.group] ** -2.0
        return prior

    def _resize(self, found: np.ndarray, known: np.ndarray) -> None:
        """Set the deviation of each group to that of its coefficients."""
        square = np.bincount(self.group, found**2, minlength=len(self.shrunk))
        number = np.bincount(self.group, known, minlength=len(self.shrunk))
        self.shrunk = np.clip(np.sqrt(square / (number + _DOUBT)), _SMALLEST, 1.0)


def _ties(table: Sequence[Signal]) -> np.ndarray:
    """Return equations that hold the mean diagonal of each group's matrix near zero, scaled, (t, 3 k)."""
    out = []
    for group in TENSORS:
        own = [number for number, signal in enumerate(table) if signal.group == group]
        if len(own) == 3:
            tie = np.zeros(3 * len(table))
            # the deviation is a share of the field: one second stands for its rate
            tie[[3 * number + axis for axis, number in enumerate(own)]] = table[own[0]].size / (3.0 * TRACE)
            out.append(tie)
    return np.array(out).reshape(-1, 3 * len(table))


def _rows_for_one(residual: np.ndarray) -> float:
    """Return how many rows of a correlated residual count as one: 1 + 2 sum of the squared autocorrelation.

    Geology lies at the lower edge of the band, and fewer of its rows are independent than the band alone leaves.
    """
    square = residual @ residual
    lags = min(_LAGS, len(residual) - 1)
    found = np.array([residual[:-lag] @ residual[lag:] for lag in range(1, lags + 1)]) / square
    return float(1.0 + 2.0 * np.sum((1.0 - np.arange(1, lags + 1) / (lags + 1)) * found**2))


def _contrasts(count: int) -> np.ndarray:
    """Return how much of each of count - 1 differences a flight has, (count, count - 1): orthonormal, of mean zero."""
    return np.linalg.qr(np.eye(count) - 1.0 / count)[0][:, : count - 1]


def _inverse(normal: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.diag(normal))
    return np.linalg.inv(normal / scale[:, None] / scale) / scale[:, None] / scale
