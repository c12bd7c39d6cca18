"""Errors to expect of a linear fit, from its columns alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import signals
from magsim.compensation.columns import ColumnSet
from magsim.compensation.covariance import CORRELATION_S, runs_of, spread_for
from magsim.compensation.field_prior import rows_as_one
from magsim.compensation.solvers import least_squares
from magsim.diagnosis.noise import white_in_band
from magsim.recording import Recording
from magsim.threads import one_blas_thread

TYPICAL = {"permanent": 100.0, "induced": 5e-3, "eddy": 1e-3}
"""Size of a coefficient of a survey aircraft: of the order that paper 000 prints for its simulated one (nT, 1, s)."""


class ColumnExcitation(NamedTuple):
    """How a column was excited, and how well its coefficient can be known."""

    name: str
    group: str
    unit: str
    std_nt: float
    """Deviation in band for a coefficient of 1 [nT per unit]."""
    own_nt: float
    """The same of what no other column has [nT per unit]."""
    error: float
    """Expected standard error of the coefficient [unit]."""
    known: bool
    """Whether that is less than the typical size of such a coefficient."""


class Advice(NamedTuple):
    """What one more minute of a maneuver on a heading would do."""

    heading: str
    maneuver: str
    line_error_nt: float
    """Expected error of the compensated reading on the survey line after it [nT]."""
    gain: float
    """Share of the error that it takes away."""


class ExcitedColumns(NamedTuple):
    """Columns in band over the rows that would be fitted."""

    matrix: np.ndarray
    """(n, c)"""
    runs: list[slice]
    names: tuple[str, ...]
    units: tuple[str, ...]
    groups: tuple[str, ...]
    rate_hz: float


def excitation(recordings: Sequence[Recording], make: ColumnSet, sensor: str) -> ExcitedColumns:
    """Return the columns in band of the rows with a reading."""
    designs = [make(recording) for recording in recordings]
    kept = [signals.in_band_rows(recording.time_s, recording.reads(sensor)) for recording in recordings]
    parts = [
        signals.in_band(design.matrix, recording.time_s, recording.reads(sensor))
        for design, recording in zip(designs, recordings, strict=True)
    ]
    times = [recording.time_s[rows] for recording, rows in zip(recordings, kept, strict=True)]
    first = designs[0]
    return ExcitedColumns(
        np.concatenate(parts), runs_of(times), first.names, first.units, first.groups, recordings[0].rate_hz
    )


@dataclass(frozen=True)
class ExpectedErrors:
    """Errors to expect of least squares with given columns and white noise of the reading.

    Attributes
    ----------
    effective_rows : float
    condition : float
        Of the scaled columns.
    covariance : (c, c)
        Of the coefficients.
    columns : tuple of ColumnExcitation
    scale : (c,)
        Deviations of the columns.
    information : (c, c)
        Inverse of the covariance of scaled coefficients, with one variance for all rows.
    row_variance : float [nT^2]
        Variance of an independent row in that.
    """

    effective_rows: float
    condition: float
    covariance: np.ndarray
    columns: tuple[ColumnExcitation, ...]
    scale: np.ndarray
    information: np.ndarray
    row_variance: float

    def line_error_nt(self, line: np.ndarray) -> float:
        """Return the root of the mean squared error of the compensated reading on a line with columns (n, c) [nT]."""
        return float(np.sqrt(max(np.einsum("ni,ij,nj->", line, self.covariance, line) / len(line), 0.0)))

    def advice(self, lines: Sequence[np.ndarray], moves: Mapping[tuple[str, str], np.ndarray]) -> tuple[Advice, ...]:
        """Return what a minute of each maneuver would do, the best first.

        Parameters
        ----------
        lines : sequence of (n, c)
            Columns of the survey line.
        moves : mapping of (heading, maneuver) to (m, c)
            Columns of a minute of each.
        """
        line = np.concatenate(lines) / self.scale
        with one_blas_thread():
            weight = line.T @ line / len(line)

        def error_nt(information: np.ndarray) -> float:
            with one_blas_thread():
                return float(np.sqrt(max(np.trace(np.linalg.solve(information, weight)), 0.0)))

        before = error_nt(self.information)
        out = []
        for (heading, maneuver), matrix in moves.items():
            scaled = matrix / self.scale
            with one_blas_thread():
                more = scaled.T @ scaled / self.row_variance
            after = error_nt(self.information + more)
            out.append(Advice(heading, maneuver, after, 1.0 - after / before))
        return tuple(sorted(out, key=lambda advice: advice.line_error_nt))


def predict(excited: ExcitedColumns, noise_nt: float) -> ExpectedErrors:
    """Predict the errors of a fit.

    Parameters
    ----------
    excited : ExcitedColumns
        At least as many rows as columns.
    noise_nt : float [nT]
        Deviation of the reading's noise in band, white below it.
    """
    matrix, rate_hz = excited.matrix, excited.rate_hz
    solution = least_squares(matrix, np.zeros(len(matrix)))
    noise = noise_nt**2 * white_in_band(rate_hz, round(CORRELATION_S * rate_hz))
    spread = spread_for(solution, matrix, excited.runs, noise)
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    own = 1.0 / np.sqrt(len(matrix) * np.maximum(np.diag(solution.gain), np.finfo(float).tiny))
    errors = np.sqrt(np.diag(spread.covariance))
    known = errors < [TYPICAL[group] for group in excited.groups]
    sizes = (scale.tolist(), own.tolist(), errors.tolist(), known.tolist())
    found = tuple(
        ColumnExcitation(*row) for row in zip(excited.names, excited.groups, excited.units, *sizes, strict=True)
    )
    row_variance = noise_nt**2 * rows_as_one(rate_hz)
    with one_blas_thread():
        information = (matrix / scale).T @ (matrix / scale) / row_variance
    return ExpectedErrors(
        spread.effective_rows, solution.condition, spread.covariance, found, scale, information, row_variance
    )
