"""Tolles-Lawson compensation with 3 to 18 terms (papers 000, eq. 26, and 001, eq. 1 to 8).

With the gradient of the Earth's field in the fit it is the model of the towed bird (paper 002, eq. 16 and 17).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from magsim.compensation.background import Direction
from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.column_rows import rows_of
from magsim.compensation.columns import Derivative, Eddy, Terms
from magsim.compensation.linear import Band, LinearFit, LinearModel, fit_linear
from magsim.compensation.platform_columns import ColumnSettings, columns_from, fit_columns
from magsim.compensation.saving import State
from magsim.compensation.solvers import SOLVERS, Solver, principal_components
from magsim.compensation.streaming import ConstantStreamer, Feed, LinearStreamer, Streamer
from magsim.compensation.targets import TargetName, rows_to_fit, target_of
from magsim.compensation.terms import Term
from magsim.dataset import Training
from magsim.errors import RequestError
from magsim.recording import Recording

Positive = Annotated[float | None, Field(gt=0.0)]


class Nothing(Compensator):
    """No compensation: the interference is taken for zero."""

    name = "none"
    lookahead_rows = 0

    def learn(self, training: Training, context: FitContext) -> None:
        """Learn nothing."""

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return zeros, (n,)."""
        return np.zeros(len(recording))

    def _streamer(self, feed: Feed) -> Streamer:
        return ConstantStreamer(0.0)

    def _coefficients(self) -> tuple[Term, ...]:
        return ()

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        return {}

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        return np.zeros(len(recording))


@dataclass(frozen=True)
class TollesLawsonReport:
    """What a Tolles-Lawson fit found.

    Attributes
    ----------
    terms : tuple of Term
    offset_nt : float [nT]
        Constant that the coefficients do not hold.
    weight : float
        Ridge weight, relative to the largest squared singular value of the scaled columns.
    condition : float
        Condition number of the scaled columns that were fitted.
    residual_nt : float [nT]
        Root of the mean squared residual of the fit, in the band where it was fitted in band.
    gradient : tuple of Term
        What was found of the Earth's field beside the platform, in nT per degree (to the power of the order) and nT per
        meter; terms of a second place end in ``[2]``. It is never subtracted.
    origins_deg : tuple of (float, float)
        Latitude and longitude of each place that the powers of the position are counted from.
    left_out : tuple of str
        Auxiliary channels that do not change, and kinds of which there is none.
    """

    terms: tuple[Term, ...]
    offset_nt: float
    weight: float
    condition: float
    residual_nt: float
    gradient: tuple[Term, ...] = ()
    origins_deg: tuple[tuple[float, float], ...] = ()
    left_out: tuple[str, ...] = ()

    def __str__(self) -> str:
        wide = max(10, *(len(term.name) for term in self.terms))
        lines = [f"{term.name:>{wide}} {term.value: .6e} +- {term.error:.1e} {term.unit}" for term in self.terms]
        lines += [f"{'offset':>{wide}} {self.offset_nt: .6e} nT"]
        if self.left_out:
            lines += [f"left out, as they do not change: {', '.join(self.left_out)}"]
        if self.gradient:
            places = "; ".join(f"{lat:.4f}, {lon:.4f}" for lat, lon in self.origins_deg)
            about = f", about latitude and longitude {places}" if places else ""
            lines += [f"gradient of the Earth's field{about} (fitted, never subtracted):"]
            width = max(10, *(len(term.name) for term in self.gradient))
            lines += [f"{term.name:>{width}} {term.value: .6e} {term.unit}" for term in self.gradient]
        lines += [f"ridge weight {self.weight:.1e}, condition {self.condition:.3g}, residual {self.residual_nt:.4g} nT"]
        return "\n".join(lines)


class TollesLawson(Compensator):
    """Permanent, induced and eddy-current interference, linear in its coefficients.

    Closed form, so the validation rows are fitted as well.

    Parameters
    ----------
    terms : {3, 8, 9, 16, 18}
        3 permanent; 5 or 6 induced; 8 or 9 eddy. 9 and 18 keep columns that follow from the others.
    target : {"interference", "measured", "model", "map", "crossings", "reference"}
        The label; or, without labels, the scalar reading as it is, minus the model of the main field, minus that and a
        map, the same with equations of lines that cross, or minus another magnetometer. What of the clean field is left
        in the band leaks into the coefficients (``docs/targets.md``). The constant is that of the labels where there
        are any.
    solver : {"ridge", "least_squares", "truncated_svd", "principal_components"}
        Ridge and truncation are chosen by generalized cross-validation.
    variance : float, optional
        Share of the variance of the columns that principal components keep, 0.9999 if not given.
    band : {"in", "broad"}
        Fit in 0.1 to 0.6 Hz; or on unfiltered rows with a constant, which gives a worse score in band and a better
        one broadband. ``measured`` and ``crossings`` need ``in``.
    fluxgate : str, optional
        The first one of the first recording if not given.
    scale : {"constant", "sample"}
        Field strength in the columns: mean length of the fluxgate reading over the training, as paper 000 folds it into
        the coefficients; or its length row by row, as paper 001. A perfect fluxgate beside the scalar sensor knows the
        answer by its length, so ``sample`` flatters there; with an imperfect one it adds its errors.
    derivative : {"central", "spline"}
        How the field is differentiated by time.
    eddy : {"direction", "field"}
        Eddy columns B u_i u_j', or u_i B_j'.
    bias : bool
        Whether a constant is fitted beside the terms and part of the estimate.
    direction : {"fluxgate", "ins", "calibrated"}
        Where the direction of the field is taken from: the fluxgate as it is, in its own axes; the model of the main
        field turned by the attitude of the INS; the fluxgate calibrated against that, in body axes.
    auxiliary : tuple of str
        Channels that make three columns each, channel times direction: ``currents``, ``voltages``, ``surfaces``, or
        names of columns. Of a kind, those that do not change are left out, as the report says.
    order : int
        Truncation order of the Earth's field as a function of latitude and longitude, 0 to 4, fitted beside the terms
        (paper 002): 2, 5, 9, 14 columns. They are signal and never subtracted; ``learn`` alone reads the position.
    vertical : bool
        Fit the vertical gradient beside the terms: one column, the height. It and ``order`` need band ``in``.
    map, map_height_m, crossing_m, crossing_height_m, reference, reference_model
        Of the targets of these names; see ``targets.choice.Targeted``.

    Attributes
    ----------
    coefficients_ : (c,)
        Of the terms, then of the auxiliary columns.
    offset_nt_ : float [nT]
    report_ : TollesLawsonReport
    """

    name = "tolles_lawson"

    def __init__(
        self,
        *,
        terms: Terms = 16,
        target: TargetName = "interference",
        solver: Literal["ridge", "least_squares", "truncated_svd", "principal_components"] = "ridge",
        variance: Annotated[float | None, Field(gt=0.0, le=1.0)] = None,
        band: Band = "in",
        fluxgate: str | None = None,
        scale: Literal["constant", "sample"] = "constant",
        derivative: Derivative = "central",
        eddy: Eddy = "direction",
        bias: bool = True,
        direction: Direction = "fluxgate",
        auxiliary: tuple[str, ...] = (),
        order: Annotated[int, Field(ge=0, le=4)] = 0,
        vertical: bool = False,
        map: str | None = None,
        map_height_m: float | None = None,
        crossing_m: Positive = None,
        crossing_height_m: Positive = None,
        reference: str | None = None,
        reference_model: str | None = None,
    ) -> None:
        self.terms = terms
        self.target = target
        self.solver = solver
        self.variance = variance
        self.band = band
        self.fluxgate = fluxgate
        self.scale = scale
        self.derivative = derivative
        self.eddy = eddy
        self.bias = bias
        self.direction = direction
        self.auxiliary = auxiliary
        self.order = order
        self.vertical = vertical
        self.map = map
        self.map_height_m = map_height_m
        self.crossing_m = crossing_m
        self.crossing_height_m = crossing_height_m
        self.reference = reference
        self.reference_model = reference_model

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What the direction is made of, and once it is fitted the families of the channels too."""
        return self._columns.reads if self.is_fitted else self._column_settings().reads

    @property
    def lookahead_rows(self) -> int | None:  # type: ignore[override]
        """What the background needs, and one row for central differences; without limit for a spline."""
        return self._columns.lookahead_rows if self.is_fitted else self._column_settings().lookahead_rows

    def _column_settings(self) -> ColumnSettings:
        by_sample = self.scale == "sample"
        return ColumnSettings(
            self.terms, self.derivative, self.eddy, self.fluxgate, by_sample, self.direction, self.auxiliary
        )

    def _solver(self) -> Solver:
        """Return the solver.

        Raises
        ------
        RequestError
            If ``variance`` has no effect.
        """
        if self.variance is None:
            return SOLVERS[self.solver]
        if self.solver != "principal_components":
            msg = f"variance has no effect with solver {self.solver!r}; allowed: with 'principal_components'"
            raise RequestError(msg)
        return partial(principal_components, share=self.variance)

    def learn(self, training: Training, context: FitContext) -> None:
        """Solve for the coefficients; see ``Compensator.learn``."""
        solve, target = self._solver(), target_of(self)
        recordings = rows_to_fit(target, training, self.name)
        self._columns = fit_columns(self._column_settings(), recordings, training.sensor)
        model = LinearModel(self._columns, target, solve, self.band, self.order, self.vertical, self.bias)
        self._fit = fit_linear(model, recordings, training.sensor)

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return columns times coefficients, (n,) [nT]; no warm-up."""
        return self._fit.estimate(self._columns(recording))

    def _streamer(self, feed: Feed) -> Streamer | None:
        """Return columns row by row, times coefficients; see ``Compensator``."""
        rows = rows_of(self._columns, feed)
        return None if rows is None else LinearStreamer(rows, self._fit.coefficients, self._fit.offset_nt)

    def _coefficients(self) -> tuple[Term, ...]:
        return self._fit.terms

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        return self._fit.shares(self._columns(recording))

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        return self._fit.uncertainty(self._columns(recording), recording.time_s)

    @property
    def coefficients_(self) -> np.ndarray:
        """Coefficients of all columns, (c,)."""
        return self._fit.coefficients

    @property
    def offset_nt_(self) -> float:
        """Constant that the coefficients do not hold [nT]."""
        return self._fit.offset_nt

    @property
    def report_(self) -> TollesLawsonReport:
        """Coefficients with units, condition number and ridge weight."""
        self.check_fitted()
        fit = self._fit
        terms = fit.terms[:-1]
        quality = fit.weight, fit.condition, fit.residual_nt
        left_out = self._columns.left_out
        return TollesLawsonReport(terms, fit.offset_nt, *quality, fit.gradient, fit.origins_deg, left_out)

    def state(self) -> State:
        """Return columns, coefficients and quality of the fit; see ``Compensator.state``."""
        fit, made = self._fit, self._columns.state()
        quality = {"weight": fit.weight, "condition": fit.condition, "residual_nt": fit.residual_nt}
        values = {
            "columns": dict(made.values),
            "offset_nt": fit.offset_nt,
            "names": list(fit.names),
            "units": list(fit.units),
            "groups": list(fit.groups),
            "effective_rows": fit.effective_rows,
            "gradient": [list(term) for term in fit.gradient],
            "origins_deg": [list(origin) for origin in fit.origins_deg],
            # JSON has no infinity
            "quality": {key: (value if np.isfinite(value) else None) for key, value in quality.items()},
        }
        return State(values, {**made.arrays, "coefficients": fit.coefficients, "covariance": fit.covariance})

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        values: Mapping[str, Any] = state.values
        self._columns = columns_from(self._column_settings(), State(values["columns"], state.arrays))
        coefficients = np.asarray(state.arrays["coefficients"], dtype=float)
        if coefficients.shape != (self._columns.count,):
            msg = f"{coefficients.shape} coefficients for {self._columns.count} columns"
            raise ValueError(msg)
        quality = {key: float("inf") if value is None else float(value) for key, value in values["quality"].items()}
        self._fit = LinearFit(
            tuple(values["names"]),
            tuple(values["units"]),
            tuple(values["groups"]),
            coefficients,
            np.asarray(state.arrays["covariance"], dtype=float),
            float(values["effective_rows"]),
            float(values["offset_nt"]),
            tuple(Term(*row) for row in values["gradient"]),
            tuple((float(lat), float(lon)) for lat, lon in values["origins_deg"]),
            **quality,
        )
