"""Linear fits: columns, a solver and a target.

Columns and target are filtered, the coefficients are used on unfiltered columns: exact for constant coefficients,
since a linear filter commutes with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.compensation.columns import ColumnSet, Design, Joined, PositionColumns, position_columns
from magsim.compensation.field_prior import sizes_of_terms, solve_with_prior
from magsim.compensation.solvers import Solution, Solver
from magsim.compensation.targets import Target, interference
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, spans

Band = Literal["in", "broad"]

ROWS_PER_TERM = 10
"""Fewest rows for each coefficient that a fit accepts."""


class Term(NamedTuple):
    """One coefficient of a fitted model."""

    name: str
    value: float
    unit: str


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
    """

    columns: ColumnSet
    target: Target
    solve: Solver
    band: Band = "in"
    order: int = 0
    vertical: bool = False

    def check(self) -> None:
        """Refuse settings that contradict each other.

        Raises
        ------
        RequestError
        """
        if self.band == "in":
            return
        if self.target.measured:
            msg = "target 'measured' needs band 'in': the unfiltered reading is nearly all Earth's field"
            raise RequestError(msg)
        if self.order or self.vertical:
            msg = "order and vertical need band 'in': unfiltered, the gradient columns would take what is slow"
            raise RequestError(msg)


@dataclass(frozen=True)
class LinearFit:
    """A fitted model.

    Attributes
    ----------
    names, units : tuple of str
        Of the columns and of their coefficients.
    coefficients : (c,)
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
    coefficients: np.ndarray
    offset_nt: float
    gradient: tuple[Term, ...]
    origins_deg: tuple[tuple[float, float], ...]
    weight: float
    condition: float
    residual_nt: float

    def estimate(self, design: Design) -> np.ndarray:
        """Return columns times coefficients with the constant, (n,) [nT]."""
        return np.einsum("nc,c->n", design.matrix, self.coefficients) + self.offset_nt


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
        If there are too few rows, or a value is not finite.
    """
    model.check()
    make = Joined((model.columns,))
    designs = [make(recording) for recording in recordings]
    targets = [model.target.values(recording, sensor) for recording in recordings]
    read = [recording.reads(sensor) for recording in recordings]
    field = position_columns(recordings, model.order, vertical=model.vertical)
    solution = _solve(model, _Rows(recordings, designs, field, targets, read))
    terms = designs[0].matrix.shape[1]
    coefficients = solution.coefficients[:terms]
    values = (solution.coefficients[terms:] / field.scale).tolist()
    beside = field.designs[0]
    return LinearFit(
        designs[0].names,
        designs[0].units,
        coefficients,
        _offset(recordings, designs, coefficients, sensor),
        tuple(Term(*row) for row in zip(beside.names, values, beside.units, strict=True)),
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


def _solve(model: LinearModel, rows: _Rows) -> Solution:
    """Solve, with the horizontal terms of the field held to the size that the slow course of the reading shows."""
    matrix, target = _equations(model, rows)
    horizontal = rows.field.horizontal >= 0
    if not horizontal.any():
        return model.solve(matrix, target)
    terms = matrix.shape[1] - len(horizontal)
    platform = np.full(terms, np.inf)
    without = model.solve(matrix[:, np.concatenate([platform > 0.0, ~horizontal])], target)
    sizes = sizes_of_terms(rows.field, rows.designs, rows.targets, without.coefficients[:terms])
    return solve_with_prior(model.solve, matrix, target, np.concatenate([platform, sizes]), rows.recordings[0].rate_hz)


def _equations(model: LinearModel, rows: _Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return columns and target over the rows with a reading: filtered and cropped, or centered.

    The columns of the platform come first, then those of the position.
    """
    if model.band == "broad":
        matrix = np.concatenate([d.matrix[read] for d, read in zip(rows.designs, rows.read, strict=True)])
        target = np.concatenate([values[read] for values, read in zip(rows.targets, rows.read, strict=True)])
        _check_length(model, matrix, rows.recordings)
        return matrix - matrix.mean(axis=0), target - target.mean()
    tables = [
        np.column_stack([d.matrix, beside.matrix, target])
        for d, beside, target in zip(rows.designs, rows.field.designs, rows.targets, strict=True)
    ]
    parts = [
        in_band(table, recording.time_s, read)
        for recording, table, read in zip(rows.recordings, tables, rows.read, strict=True)
    ]
    filtered = parts[0] if len(parts) == 1 else np.concatenate(parts)
    _check_length(model, filtered[:, :-1], rows.recordings)
    return filtered[:, :-1], filtered[:, -1]


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


def _offset(recordings: Sequence[Recording], designs: Sequence[Design], coefficients: np.ndarray, sensor: str) -> float:
    """Return the mean of the labels that the coefficients leave, over the rows with a reading; 0 without labels."""
    name = columns.INTERFERENCE.name(sensor=sensor)
    if any(name not in recording for recording in recordings):
        return 0.0
    rest = [
        (interference(recording, sensor) - np.einsum("nc,c->n", d.matrix, coefficients))[recording.reads(sensor)]
        for recording, d in zip(recordings, designs, strict=True)
    ]
    return float(np.concatenate(rest).mean())
