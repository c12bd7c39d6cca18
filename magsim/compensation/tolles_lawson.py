"""Tolles-Lawson compensation with 16 or 18 terms (papers 000, eq. 26, and 001, eq. 1 to 8).

With the gradient of the Earth's field in the fit it is the model of the towed bird (paper 002, eq. 16 and 17).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field

from magsim import columns, metrics, signals
from magsim.compensation.base import Compensator, check_recordings, labels, pick_fluxgate, reading_rows
from magsim.compensation.features import Design, Inputs, design, requirements, spans
from magsim.compensation.gradient import Gradient, gradient
from magsim.compensation.ridge import RidgeFit, fit_ridge
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

ROWS_PER_TERM = 10
"""Fewest rows for each coefficient that a fit accepts."""


class Nothing(Compensator):
    """No compensation: the interference is taken for zero."""

    name = "none"

    def fit(
        self,
        train: Sequence[Recording],
        *,
        sensor: str,
        valid: Sequence[Recording] = (),
        seed: int = 0,
    ) -> Self:
        """Note the sensor."""
        check_recordings(train, sensor)
        self.sensor_ = sensor
        return self

    def interference(self, recording: Recording) -> np.ndarray:
        """Zeros, (n,)."""
        self._require_fitted()
        return np.zeros(len(recording))


class Term(NamedTuple):
    """One coefficient of a fitted model."""

    name: str
    value: float
    unit: str


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
        meter; terms of a second place end in ``[2]``. It is never taken away.
    origins_deg : tuple of (float, float)
        Latitude and longitude of each place that the powers of the position are counted from.
    """

    terms: tuple[Term, ...]
    offset_nt: float
    weight: float
    condition: float
    residual_nt: float
    gradient: tuple[Term, ...] = ()
    origins_deg: tuple[tuple[float, float], ...] = ()

    def __str__(self) -> str:
        lines = [f"{term.name:>10} {term.value: .6e} {term.unit}" for term in self.terms]
        lines += [f"{'offset':>10} {self.offset_nt: .6e} nT"]
        if self.gradient:
            places = "; ".join(f"{lat:.4f}, {lon:.4f}" for lat, lon in self.origins_deg)
            about = f", about latitude and longitude {places}" if places else ""
            lines += [f"gradient of the Earth's field{about} (fitted, never taken away):"]
            width = max(10, *(len(term.name) for term in self.gradient))
            lines += [f"{term.name:>{width}} {term.value: .6e} {term.unit}" for term in self.gradient]
        lines += [f"ridge weight {self.weight:.1e}, condition {self.condition:.3g}, residual {self.residual_nt:.4g} nT"]
        return "\n".join(lines)


class TollesLawson(Compensator):
    """Permanent, induced and eddy-current interference, linear in its coefficients.

    Fitted on filtered columns and a filtered target, used on unfiltered columns: exact for constant coefficients,
    since a linear filter commutes with them. Closed form, so the validation recordings are fitted as well.

    Parameters
    ----------
    terms : {16, 18}
        18 keeps two columns that follow from the others.
    target : {"interference", "measured"}
        The label, or the band-passed scalar reading (self-supervised: what of the clean field lies in the band leaks
        into the coefficients). With ``measured`` the constant is still that of the labels where there are any.
    band : {"in", "broad"}
        Fit in 0.1 to 0.6 Hz; or on unfiltered rows with a constant, which gives a worse score in band and a better
        one broadband. ``measured`` needs ``in``.
    fluxgate : str, optional
        The first one of the first recording if not given.
    scale : {"constant", "sample"}
        Field strength in the columns: mean length of the fluxgate reading over the training, as paper 000 folds it into
        the coefficients; or its length row by row, as paper 001. A perfect fluxgate beside the scalar sensor knows the
        answer by its length, so ``sample`` flatters there; with an imperfect one it adds its errors.
    derivative : {"central", "spline"}
        How direction cosines are differentiated.
    order : int
        Truncation order of the Earth's field as a function of latitude and longitude, 0 to 4, fitted beside the terms
        (paper 002): 2, 5, 9, 14 columns. They are signal and never taken away; ``fit`` alone reads the position.
    vertical : bool
        Fit the vertical gradient beside the terms: one column, the height. It and ``order`` need band ``in``.

    Attributes
    ----------
    coefficients_ : (terms,)
    offset_nt_ : float
    report_ : TollesLawsonReport
    """

    requires = requirements(("tl16",))

    def __init__(
        self,
        *,
        terms: Literal[16, 18] = 16,
        target: Literal["interference", "measured"] = "interference",
        band: Literal["in", "broad"] = "in",
        fluxgate: str | None = None,
        scale: Literal["constant", "sample"] = "constant",
        derivative: Literal["central", "spline"] = "central",
        order: Annotated[int, Field(ge=0, le=4)] = 0,
        vertical: bool = False,
    ) -> None:
        self.terms = terms
        self.target = target
        self.band = band
        self.fluxgate = fluxgate
        self.scale = scale
        self.derivative = derivative
        self.order = order
        self.vertical = vertical

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name in the registry."""
        if self.target != "measured":
            return f"tl{self.terms}"
        towed = self.terms == 16 and (self.order or self.vertical)
        return f"tl{self.terms}_" + ("gradient" if towed else "measured")

    @property
    def causal(self) -> bool:  # type: ignore[override]
        """A spline looks ahead, without end."""
        return self.derivative == "central"

    def fit(
        self,
        train: Sequence[Recording],
        *,
        sensor: str,
        valid: Sequence[Recording] = (),
        seed: int = 0,
    ) -> Self:
        """Solve for the coefficients; see ``Compensator.fit``."""
        recordings = [*train, *valid]
        check_recordings(recordings, sensor)
        cut = reading_rows(recordings, sensor)
        # The band-pass would spread what the reading holds in dropouts; the label is right there too.
        recordings = cut if self.target == "measured" else recordings
        self.set_params(**self.get_params())
        self._check_band()
        self._inputs = self._make_inputs(recordings)
        designs = [self._design(recording) for recording in recordings]
        targets = [self._target(recording, sensor) for recording in recordings]
        read = [recording.reads(sensor) for recording in recordings]
        field = gradient(recordings, self.order, vertical=self.vertical)
        fit = self._solve(recordings, designs, field, targets, read)
        self.coefficients_ = fit.coefficients[: self.terms]
        self.offset_nt_ = self._offset(recordings, designs, sensor)
        self.sensor_ = sensor
        self._names, self._units = designs[0].names, designs[0].units
        values = (fit.coefficients[self.terms :] / field.scale).tolist()
        found = field.designs[0]
        self._gradient = tuple(Term(*row) for row in zip(found.names, values, found.units, strict=True))
        self._origins = tuple((place.lat_deg, place.lon_deg) for place in field.places if self.order)
        self._quality = {"weight": fit.weight, "condition": fit.condition, "residual_nt": fit.residual_std}
        return self

    @property
    def report_(self) -> TollesLawsonReport:
        """Coefficients with units, condition number and ridge weight."""
        self._require_fitted()
        values = self.coefficients_.tolist()
        terms = tuple(Term(*row) for row in zip(self._names, values, self._units, strict=True))
        found = {"gradient": self._gradient, "origins_deg": self._origins}
        return TollesLawsonReport(terms, self.offset_nt_, **self._quality, **found)

    def interference(self, recording: Recording) -> np.ndarray:
        """Columns times coefficients, (n,) [nT]; no warm-up."""
        self._require_fitted()
        return np.einsum("nc,c->n", self._design(recording).matrix, self.coefficients_) + self.offset_nt_

    def _check_band(self) -> None:
        if self.band == "in":
            return
        if self.target == "measured":
            msg = "target 'measured' needs band 'in': the unfiltered reading is nearly all Earth's field"
            raise RequestError(msg)
        if self.order or self.vertical:
            msg = "order and vertical need band 'in': unfiltered, the gradient columns would take what is slow"
            raise RequestError(msg)

    def _make_inputs(self, recordings: Sequence[Recording]) -> Inputs:
        fluxgate = pick_fluxgate(recordings, self.fluxgate)
        if self.scale == "sample":
            return Inputs(fluxgate, self.derivative)
        readings = np.concatenate([r.vector(columns.FLUX, sensor=fluxgate) for r in recordings])
        return Inputs(fluxgate, self.derivative, float(np.linalg.norm(readings, axis=1).mean()))

    def _design(self, recording: Recording) -> Design:
        return design(recording, self._inputs, (f"tl{self.terms}",))

    def _target(self, recording: Recording, sensor: str) -> np.ndarray:
        if self.target == "interference":
            return labels(recording, sensor)
        reading = recording[columns.MAG.name(sensor=sensor)]
        if not np.isfinite(reading).all():
            when = recording.time_s[np.argmin(np.isfinite(reading))]
            msg = f"recording {recording.name!r}: scalar magnetometer {sensor!r} is not finite at {when:g} s"
            raise DataError(msg)
        return reading

    def _solve(
        self,
        recordings: Sequence[Recording],
        designs: Sequence[Design],
        field: Gradient,
        targets: Sequence[np.ndarray],
        read: Sequence[np.ndarray],
    ) -> RidgeFit:
        """Filter and crop, or center, and solve over the rows with a reading: for the terms, then the gradient."""
        if self.band == "broad":
            matrix = np.concatenate([d.matrix[rows] for d, rows in zip(designs, read, strict=True)])
            target = np.concatenate([values[rows] for values, rows in zip(targets, read, strict=True)])
            self._check_length(matrix, recordings)
            return fit_ridge(matrix - matrix.mean(axis=0), target - target.mean())
        tables = [
            np.column_stack([d.matrix, beside.matrix, target])
            for d, beside, target in zip(designs, field.designs, targets, strict=True)
        ]
        parts = [
            in_band(table, recording.time_s, rows)
            for recording, table, rows in zip(recordings, tables, read, strict=True)
        ]
        rows = np.concatenate(parts)
        self._check_length(rows[:, :-1], recordings)
        return fit_ridge(rows[:, :-1], rows[:, -1])

    def _check_length(self, matrix: np.ndarray, recordings: Sequence[Recording]) -> None:
        rows, needed = len(matrix), ROWS_PER_TERM * matrix.shape[1]
        if rows < needed:
            longest = max(float(r.time_s[s.stop - 1] - r.time_s[s.start]) for r in recordings for s in spans(r.time_s))
            edge = f" after {signals.EDGE_S:g} s at each end of each piece" if self.band == "in" else ""
            msg = (
                f"{self.name} needs at least {needed} training rows{edge}, and has {rows}; the longest piece without "
                f"a gap lasts {longest:g} s"
            )
            raise DataError(msg)

    def _offset(self, recordings: Sequence[Recording], designs: Sequence[Design], sensor: str) -> float:
        """Mean of the labels that the coefficients leave, over the rows with a reading; 0 where there are no labels."""
        name = columns.INTERFERENCE.name(sensor=sensor)
        if any(name not in recording for recording in recordings):
            return 0.0
        rest = [
            (labels(recording, sensor) - np.einsum("nc,c->n", d.matrix, self.coefficients_))[recording.reads(sensor)]
            for recording, d in zip(recordings, designs, strict=True)
        ]
        return float(np.concatenate(rest).mean())

    def _learned(self) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
        values = {
            "fluxgate": self._inputs.fluxgate,
            "strength_nt": self._inputs.strength_nt,
            "offset_nt": self.offset_nt_,
            "names": list(self._names),
            "units": list(self._units),
            "gradient": [list(term) for term in self._gradient],
            "origins_deg": [list(origin) for origin in self._origins],
            # JSON has no infinity
            "quality": {k: (v if np.isfinite(v) else None) for k, v in self._quality.items()},
        }
        return values, {"coefficients": self.coefficients_}

    def _restore(self, values: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
        self._inputs = Inputs(values["fluxgate"], self.derivative, values["strength_nt"])
        self.offset_nt_ = float(values["offset_nt"])
        self._names, self._units = tuple(values["names"]), tuple(values["units"])
        self._gradient = tuple(Term(*row) for row in values.get("gradient", ()))
        self._origins = tuple((float(lat), float(lon)) for lat, lon in values.get("origins_deg", ()))
        self._quality = {k: float("inf") if v is None else float(v) for k, v in values["quality"].items()}
        self.coefficients_ = np.asarray(arrays["coefficients"], dtype=float)
        if self.coefficients_.shape != (self.terms,):
            msg = f"{self.coefficients_.shape} coefficients for {self.terms} terms"
            raise ValueError(msg)


def in_band(values: np.ndarray, time_s: np.ndarray, rows: np.ndarray | None = None) -> np.ndarray:
    """Rows of (n, ...) in 0.1 to 0.6 Hz: each piece filtered by itself, its ends left out.

    Pieces that are shorter than both ends together give no rows. With a mask ``rows`` only those are given, filtered
    together with the others.
    """
    rate_hz = 1.0 / np.median(np.diff(time_s))
    parts = [values[:0]]
    for span in spans(time_s):
        keep = metrics.crop(time_s[span])
        if rows is not None:
            keep &= rows[span]
        if keep.any():
            parts.append(signals.band_pass(values[span], rate_hz)[keep])
    return np.concatenate(parts)
