"""Vector Tolles-Lawson: the platform's field as a vector, taken from the field vector, by nonlinear least squares.

    B      = u B_t                               direction of the fluxgate, length of the scalar reading
    Ba     = a + b B + c dB/dt [+ d d2B/dt2]     3 + 9 + 9 [+ 9] coefficients
    I      = B_t - |B - Ba|

It keeps the second order that the projection of Tolles-Lawson leaves, and is exact where fluxgate and scalar sensor are
in one place. Elsewhere it is no better than Tolles-Lawson, or worse: it takes the direction that the fluxgate sees for
that of the field at the sensor.
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from magsim.columns import FLUX, MAG
from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.columns import Derivative, pick_fluxgate
from magsim.compensation.columns.direction import direction_cosines, time_derivative
from magsim.compensation.observability import check_channels, check_directions
from magsim.compensation.saving import State
from magsim.compensation.targets import KnownField, Label, Reading, Target, reading, reading_rows, rows_to_fit
from magsim.compensation.terms import Term
from magsim.compensation.vector_fit import LABEL_WEIGHT, READING_WEIGHT, VectorFit, VectorRows, fit_vector
from magsim.dataset import Training
from magsim.recording import Recording
from magsim.signals import band_pass, spans

SOURCES = (("a", "nT", "permanent"), ("b", "1", "induced"), ("c", "s", "eddy"), ("d", "s^2", "eddy lag"))
"""Letter, unit and group of the coefficients of the vector and of each matrix."""

TARGETS: dict[str, Target] = {"interference": Label(), "measured": Reading(), "model": KnownField()}


class VectorTollesLawson(Compensator):
    """The platform's field as a vector, from the fluxgate's direction and the scalar reading's length.

    Validation rows are fitted as well. The reading is an input: an anomaly in it passes, since |B - Ba| follows it.

    Parameters
    ----------
    target : {"interference", "measured", "model"}
        The label; or without labels, the clean field taken for constant, or for the model of the main field and a
        constant.
    second_derivative : bool
        Fit the second derivative of the field too: the lag of eddy currents, to first order.
    fluxgate : str, optional
        The first one of the first recording if not given.
    derivative : {"spline", "central"}
        How the field vector is differentiated by time. A spline looks ahead without limit; central differences need one
        row, or two with the second derivative.

    Attributes
    ----------
    fit_ : VectorFit
    """

    name = "vector_tl"
    requires = (FLUX.pattern, MAG.pattern)

    def __init__(
        self,
        *,
        target: Literal["interference", "measured", "model"] = "interference",
        second_derivative: bool = False,
        fluxgate: str | None = None,
        derivative: Derivative = "spline",
    ) -> None:
        self.target = target
        self.second_derivative = second_derivative
        self.fluxgate = fluxgate
        self.derivative = derivative

    @property
    def lookahead_rows(self) -> int | None:  # type: ignore[override]
        """As many rows as there are derivatives, for central differences; without limit for a spline."""
        return None if self.derivative == "spline" else 1 + self.second_derivative

    @property
    def memory_rows(self) -> int | None:  # type: ignore[override]
        """As many rows as are looked ahead."""
        return self.lookahead_rows

    def learn(self, training: Training, context: FitContext) -> None:
        """Fit; see ``Compensator.learn``."""
        target = TARGETS[self.target]
        known = rows_to_fit(target, training, self.name)
        recordings = reading_rows(known, training.sensor)
        self._fluxgate = pick_fluxgate(recordings, self.fluxgate)
        self._sensor = training.sensor
        check_channels(recordings, self.requires, training.sensor)
        names = [recording.name for recording in recordings]
        check_directions([direction_cosines(recording, self._fluxgate)[0] for recording in recordings], names)
        rows = []
        for recording in recordings:
            scalar = reading(recording, training.sensor)
            reference = scalar - target.values(recording, training.sensor)
            if target.measured:
                reference += (scalar - reference).mean()
            rows.append(VectorRows(recording.time_s, self._vectors(recording), reference))
        self._fit = fit_vector(rows, READING_WEIGHT if target.measured else LABEL_WEIGHT)

    def estimate(self, recording: Recording) -> np.ndarray:
        """Return reading minus clean length, (n,) [nT]; no warm-up."""
        return recording[MAG.name(sensor=self._sensor)] - self._fit.clean(self._vectors(recording))

    def _vectors(self, recording: Recording) -> tuple[np.ndarray, ...]:
        """Return the field vector and its derivatives, (n, 3) each."""
        cosines, _ = direction_cosines(recording, self._fluxgate)
        found = [cosines * reading(recording, self._sensor)[:, None]]
        for _ in range(1 + self.second_derivative):
            found.append(time_derivative(found[-1], recording.time_s, self.derivative))
        return tuple(found)

    def _coefficients(self) -> tuple[Term, ...]:
        fit = self._fit
        values = [fit.permanent_nt, *fit.matrices]
        errors = iter(np.sqrt(np.diag(fit.covariance)).tolist())
        out = []
        for (letter, unit, group), block in zip(SOURCES, values, strict=False):
            for place, value in np.ndenumerate(block):
                name = letter + "".join(str(i + 1) for i in place)
                out.append(Term(name, float(value), unit, next(errors), group))
        return tuple(out)

    def _shares(self, recording: Recording) -> dict[str, np.ndarray]:
        """Return what the length loses as one source after the other is taken off the field."""
        vectors = self._vectors(recording)
        left, length = vectors[0], np.linalg.norm(vectors[0], axis=1)
        out: dict[str, np.ndarray] = {}
        for (_, _, group), part in zip(SOURCES, self._fit.parts(vectors), strict=False):
            left = left - part
            before, length = length, np.linalg.norm(left, axis=1)
            out[group] = before - length
        return out

    def _uncertainty(self, recording: Recording) -> np.ndarray:
        slopes = self._fit.slopes(self._vectors(recording))
        band = np.concatenate([band_pass(slopes[span], recording.rate_hz) for span in spans(recording.time_s)])
        variance = np.einsum("ni,ij,nj->n", band, self._fit.covariance, band, optimize=False)
        return np.sqrt(np.maximum(variance, 0.0))

    @property
    def fit_(self) -> VectorFit:
        """Coefficients and the residual of the fit."""
        self.check_fitted()
        return self._fit

    def state(self) -> State:
        """Return coefficients and names; see ``Compensator.state``."""
        fit = self._fit
        values = {"fluxgate": self._fluxgate, "sensor": self._sensor, "residual_nt": fit.residual_nt}
        arrays = {"permanent_nt": fit.permanent_nt, "matrices": fit.matrices, "covariance": fit.covariance}
        return State(values, arrays)

    def set_state(self, state: State) -> None:
        """Take back what ``state`` returned."""
        values: Mapping[str, Any] = state.values
        matrices = 2 + self.second_derivative
        shapes = {"permanent_nt": (3,), "matrices": (matrices, 3, 3), "covariance": (3 + 9 * matrices,) * 2}
        arrays = {name: np.asarray(state.arrays[name], dtype=float) for name in shapes}
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                msg = f"{name} has shape {arrays[name].shape}, expected {shape}"
                raise ValueError(msg)
        self._fluxgate, self._sensor = str(values["fluxgate"]), str(values["sensor"])
        self._fit = VectorFit(**arrays, residual_nt=float(values["residual_nt"]))
