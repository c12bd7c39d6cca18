"""Linear fits: columns, a solver and a target.

Columns and target are filtered, the coefficients are used on unfiltered columns: exact for constant coefficients,
since a linear filter commutes with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.compensation.columns import ColumnSet, Design, Joined, PositionColumns, position_columns
from magsim.compensation.covariance import CoefficientSpread, runs_of, spread_of
from magsim.compensation.field_prior import sizes_of_terms, solve_with_prior
from magsim.compensation.observability import check_angle, check_channels
from magsim.compensation.solvers import Solution, Solver
from magsim.compensation.targets import Pairs, Target, interference, weight_of_pairs
from magsim.compensation.terms import Term
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, spans

Band = Literal["in", "broad"]

OFFSET = "offset"
"""Name and group of the constant."""

ROWS_PER_TERM = 10
"""Fewest rows for each coefficient that a fit accepts."""


@dataclass(frozen=True)
class LinearModel:
    """What is fitted, and how.

    Attributes
    ----------
    columns : ColumnSet
        Of the platform; they make the estimate.
    target : Target
    solve : Solver
    band : {"in", "broad"}
        Fit in 0.1 to 0.6 Hz, or unfiltered with a constant.
    order : int
        Order of the Earth's field as a polynomial of the position, fitted beside the columns; 0 for none.
    vertical : bool
        Fit the height beside the columns.
    bias : bool
        Whether there is a constant.
    """

    columns: ColumnSet
    target: Target
    solve: Solver
    band: Band = "in"
    order: int = 0
    vertical: bool = False
    bias: bool = True

    def check(self) -> None:
        """Refuse settings that contradict each other.

        Raises
        ------
        RequestError
        """
        if self.band == "in":
            return
        if not self.target.broadband:
            msg = (
                f"target {self.target.name!r} needs band 'in': unfiltered, what is left of the Earth's field would be "
                "taken for interference"
            )
            raise RequestError(msg)
        if self.order or self.vertical:
            msg = "order and vertical need band 'in': unfiltered, the gradient columns would take what is slow"
            raise RequestError(msg)


@dataclass(frozen=True)
class LinearFit:
    """A fitted model.

    Attributes
    ----------
    names, units, groups : tuple of str
        Of the columns and of their coefficients.
    coefficients : (c,)
    covariance : (c, c)
        Of the coefficients; see ``magsim.compensation.covariance``.
    effective_rows : float
        Independent rows that would tell as much as the correlated ones do.
    offset_nt : float [nT]
        Constant that the coefficients do not hold.
    gradient : tuple of Term
        What was found of the Earth's field beside the platform, in physical units; never subtracted.
    origins_deg : tuple of (float, float)
        Latitude and longitude that the powers of the position are counted from, for each place flown.
    weight, condition, residual_nt : float
        See ``Solution``.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    groups: tuple[str, ...]
    coefficients: np.ndarray
    covariance: np.ndarray
    effective_rows: float
    offset_nt: float
    gradient: tuple[Term, ...]
    origins_deg: tuple[tuple[float, float], ...]
    weight: float
    condition: float
    residual_nt: float

    def estimate(self, design: Design) -> np.ndarray:
        """Return columns times coefficients with the constant, (n,) [nT]."""
        return np.einsum("nc,c->n", design.matrix, self.coefficients) + self.offset_nt

    @property
    def terms(self) -> tuple[Term, ...]:
        """Coefficients with their standard errors, then the constant."""
        errors = np.sqrt(np.diag(self.covariance)).tolist()
        rows = zip(self.names, self.coefficients.tolist(), self.units, errors, self.groups, strict=True)
        return (*(Term(*row) for row in rows), Term(OFFSET, self.offset_nt, "nT", None, OFFSET))

    def shares(self, design: Design) -> dict[str, np.ndarray]:
        """Return the estimate by group, (n,) [nT] each; the constant is a group of its own."""
        out: dict[str, np.ndarray] = {}
        for group in dict.fromkeys(self.groups):
            mine = np.array([other == group for other in self.groups])
            out[group] = np.einsum("nc,c->n", design.matrix[:, mine], self.coefficients[mine])
        return {**out, OFFSET: np.full(len(design.matrix), self.offset_nt)}

    def uncertainty(self, design: Design, time_s: np.ndarray) -> np.ndarray:
        """Return the standard error of the estimate in band, from the covariance of the coefficients, (n,) [nT]."""
        rate_hz = 1.0 / signals.median_step(time_s)
        band = np.concatenate([signals.band_pass(design.matrix[span], rate_hz) for span in spans(time_s)])
        variance = np.einsum("ni,ij,nj->n", band, self.covariance, band, optimize=False)
        return np.sqrt(np.maximum(variance, 0.0))


def fit_linear(model: LinearModel, recordings: Sequence[Recording], sensor: str) -> LinearFit:
    """Fit a linear model.

    Parameters
    ----------
    model : LinearModel
    recordings : sequence of Recording
        As ``targets.rows_to_fit`` gives them.
    sensor : str
        The scalar magnetometer.

    Raises
    ------
    RequestError
        If settings contradict each other, or a column or label is missing.
    DataError
        If there are too few rows, a value is not finite, a channel is dead, or the field turns too little.
    """
    model.check()
    check_channels(recordings, (*model.columns.reads, *((columns.MAG.pattern,) * model.target.measured)), sensor)
    make = Joined((model.columns,))
    designs = [make(recording) for recording in recordings]
    targets = [model.target.values(recording, sensor) for recording in recordings]
    read = [recording.reads(sensor) for recording in recordings]
    field = position_columns(recordings, model.order, vertical=model.vertical)
    rows = _Rows(recordings, designs, field, targets, read)
    solution, spread = _solve(model, rows, model.target.pairs(recordings, sensor))
    check_angle(designs, read, [recording.name for recording in recordings])
    terms = designs[0].matrix.shape[1]
    coefficients = solution.coefficients[:terms]
    values = (solution.coefficients[terms:] / field.scale).tolist()
    errors = (np.sqrt(np.diag(spread.covariance)[terms:]) / field.scale).tolist()
    beside = field.designs[0]
    return LinearFit(
        designs[0].names,
        designs[0].units,
        designs[0].groups,
        coefficients,
        spread.covariance[:terms, :terms],
        spread.effective_rows,
        _offset(model, rows, coefficients, sensor),
        tuple(Term(*row, "gradient") for row in zip(beside.names, values, beside.units, errors, strict=True)),
        tuple((area.lat_deg, area.lon_deg) for area in field.areas if model.order),
        solution.weight,
        solution.condition,
        solution.residual_std,
    )


class _Rows(NamedTuple):
    """What a fit is made from, one entry for each recording."""

    recordings: Sequence[Recording]
    designs: Sequence[Design]
    field: PositionColumns
    targets: Sequence[np.ndarray]
    read: Sequence[np.ndarray]
    """Rows with a reading."""


class Equations(NamedTuple):
    """What a solver gets."""

    matrix: np.ndarray
    """(n, c)"""
    target: np.ndarray
    """(n,)"""
    runs: list[slice]
    """Rows without a gap, whose noise is correlated."""


def _solve(model: LinearModel, rows: _Rows, pairs: Pairs | None) -> tuple[Solution, CoefficientSpread]:
    """Solve the equations in band and those of pairs of rows; the residual is that of the rows in band."""
    band = _equations(model, rows)
    equations = band if pairs is None else _with_pairs(band, rows, pairs)
    found = _with_prior(model, rows, equations)
    spread = spread_of(found, *equations, rows.recordings[0].rate_hz)
    if pairs is None:
        return found, spread
    left = band.target - np.einsum("nc,c->n", band.matrix, found.coefficients)
    return replace(found, residual_std=float(np.sqrt(np.mean(left**2)))), spread


def _with_prior(model: LinearModel, rows: _Rows, equations: Equations) -> Solution:
    """Solve, with the horizontal terms of the field held to the size that the slow course of the reading shows."""
    matrix, target, _ = equations
    horizontal = rows.field.horizontal >= 0
    if not horizontal.any():
        return model.solve(matrix, target)
    terms = matrix.shape[1] - len(horizontal)
    platform = np.full(terms, np.inf)
    without = model.solve(matrix[:, np.concatenate([platform > 0.0, ~horizontal])], target)
    sizes = sizes_of_terms(rows.field, rows.designs, rows.targets, without.coefficients[:terms])
    return solve_with_prior(model.solve, matrix, target, np.concatenate([platform, sizes]), rows.recordings[0].rate_hz)


def _equations(model: LinearModel, rows: _Rows) -> Equations:
    """Return columns and target over the rows with a reading: filtered and cropped, or centered.

    The columns of the platform come first, then those of the position.
    """
    pairs = list(zip(rows.recordings, rows.read, strict=True))
    if model.band == "broad":
        matrix = np.concatenate([d.matrix[read] for d, read in zip(rows.designs, rows.read, strict=True)])
        target = np.concatenate([values[read] for values, read in zip(rows.targets, rows.read, strict=True)])
        _check_length(model, matrix, rows.recordings)
        runs = runs_of([recording.time_s[read] for recording, read in pairs])
        if not model.bias:
            return Equations(matrix, target, runs)
        return Equations(matrix - matrix.mean(axis=0), target - target.mean(), runs)
    tables = [
        np.column_stack([d.matrix, beside.matrix, target])
        for d, beside, target in zip(rows.designs, rows.field.designs, rows.targets, strict=True)
    ]
    parts = [in_band(table, recording.time_s, read) for (recording, read), table in zip(pairs, tables, strict=True)]
    filtered = parts[0] if len(parts) == 1 else np.concatenate(parts)
    _check_length(model, filtered[:, :-1], rows.recordings)
    runs = runs_of([recording.time_s[signals.in_band_rows(recording.time_s, read)] for recording, read in pairs])
    return Equations(filtered[:, :-1], filtered[:, -1], runs)


def _with_pairs(band: Equations, rows: _Rows, pairs: Pairs) -> Equations:
    """Return the equations in band with those of pairs of rows at one place below them, weighted."""
    designs = [np.hstack([d.matrix, f.matrix]) for d, f in zip(rows.designs, rows.field.designs, strict=True)]
    apart, wanted = pairs.differences(designs), pairs.target(rows.targets)
    weight = weight_of_pairs(pairs, band[:2], (apart, wanted))
    matrix, target = np.concatenate([band.matrix, weight * apart]), np.concatenate([band.target, weight * wanted])
    return Equations(matrix, target, [*band.runs, slice(len(band.target), len(target))])


def _check_length(model: LinearModel, matrix: np.ndarray, recordings: Sequence[Recording]) -> None:
    rows, needed = len(matrix), ROWS_PER_TERM * matrix.shape[1]
    if rows < needed:
        longest = max(float(r.time_s[s.stop - 1] - r.time_s[s.start]) for r in recordings for s in spans(r.time_s))
        edge = f" after {signals.EDGE_S:g} s at each end of each piece" if model.band == "in" else ""
        msg = (
            f"a fit of {matrix.shape[1]} columns needs at least {needed} training rows{edge}, and has {rows}; the "
            f"longest piece without a gap lasts {longest:g} s"
        )
        raise DataError(msg)


def _offset(model: LinearModel, rows: _Rows, coefficients: np.ndarray, sensor: str) -> float:
    """Return the mean that the coefficients leave, over the rows with a reading.

    Of the labels where there are any, else of the target where its mean was fitted, else 0; 0 without a bias.
    """
    if not model.bias:
        return 0.0
    name = columns.INTERFERENCE.name(sensor=sensor)
    if all(name in recording for recording in rows.recordings):
        values: Sequence[np.ndarray] = [interference(recording, sensor) for recording in rows.recordings]
    elif model.band == "broad":
        values = rows.targets
    else:
        return 0.0
    rest = [
        (value - np.einsum("nc,c->n", design.matrix, coefficients))[read]
        for value, design, read in zip(values, rows.designs, rows.read, strict=True)
    ]
    return float(np.concatenate(rest).mean())
