"""The fit of a ``CalibratedField``: direction from INS and model field, sharpened by the length of the field.

An INS is wrong by some 0.02 deg, which is 20 nT of direction, slowly. The length of the field is known in the band of
motion to some 0.03 nT, and what turns the whole background at once is of no account for a compensation. So the matrix
is found from the direction first, and then by Gauss-Newton steps from both: direction with a deviation of ``INS_NT``,
length in 0.02 to 1 Hz with the deviation that it turns out to have.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from magsim.compensation.background.calibrated import CalibratedField, Regressors, fluxgate_reading
from magsim.compensation.background.model import Aligned, model_along
from magsim.compensation.reduction import Reduction
from magsim.errors import DataError
from magsim.frames import rotate_back
from magsim.recording import Recording
from magsim.signals import spans
from magsim.threads import one_blas_thread

LENGTH_BAND_HZ = (0.02, 1.0)
"""Where lengths are compared: below lie daily variation, geology and the drift of the INS."""

INS_NT = 60.0
"""Deviation of INS attitude times model field: 0.05 to 0.1 deg, an inertial system with satellite aiding (estimate)."""

OFFSET_NT = 80.0
"""Deviation of each component of what the Earth's field is more than the model: crust and external fields of 100 to
200 nT (Alken et al., 2021, Earth, Planets and Space 73, 49, section 4; estimate)."""

MOST_OFFSET_NT = 1200.0
"""Beyond this the INS or the date is wrong, not the field: 1.8 deg of heading where it turns 38 000 nT. A fluxgate that
is another one on another flight may take as much as 900 nT (aircraft of one type)."""

LAG_S, CURVATURE_S2 = 0.2, 0.01
"""Deviations of the lag and of the curvature of a fluxgate (estimate: readings are late by up to two rows)."""

RATE_S = 0.003
"""Deviation of the coefficients of the derivative: eddy currents at the fluxgate, some 1e-3 s (field of the C208B)."""

CHANNEL_NT = 30.0
"""Deviation of what a channel does at the fluxgate, for one deviation of the channel (estimate)."""

MOST_LAG_S = 0.6

_STEPS = 3
_EVERY = 10
"""One of so many rows is compared in direction: the INS is wrong slowly."""


@dataclass(frozen=True)
class _Flight:
    """One training recording as the fit needs it."""

    recording: Recording
    aligned: Aligned
    length_nt: np.ndarray | None
    """Length of the background where the labels tell it."""
    channels: np.ndarray
    """Channels of the regressors."""


@dataclass
class _Unknowns:
    """What is found: the matrix for scaled columns, an offset for each flight, lag and curvature."""

    matrix: np.ndarray
    offsets_n: np.ndarray
    lag_s: float
    curvature_s2: float

    def as_vector(self) -> np.ndarray:
        return np.concatenate([self.matrix.T.ravel(), self.offsets_n.ravel(), [self.lag_s, self.curvature_s2]])

    def moved(self, step: np.ndarray) -> "_Unknowns":
        vector = self.as_vector() + step
        size = self.matrix.size
        matrix = vector[:size].reshape(3, -1).T
        return _Unknowns(matrix, vector[size:-2].reshape(-1, 3), float(vector[-2]), float(vector[-1]))


def calibrate(
    recordings: Sequence[Recording],
    regressors: Regressors,
    lengths: Sequence[np.ndarray | None],
    reads: Sequence[np.ndarray],
) -> CalibratedField:
    """Calibrate a fluxgate.

    Parameters
    ----------
    recordings : sequence of Recording
    regressors : Regressors
    lengths : sequence of (n,) [nT] or None
        Length of the background where it is known; None where the model field has to do.
    reads : sequence of (n,) bool
        Rows whose length may be used.

    Raises
    ------
    RequestError
        If a recording lacks a column or its date.
    DataError
        If a value is not finite, rows are too few, or INS, date and fluxgate do not go together.
    """
    flights = [
        _Flight(recording, model_along(recording), length, regressors.channels_of(recording))
        for recording, length in zip(recordings, lengths, strict=True)
    ]
    times = [recording.time_s for recording in recordings]
    reduction = Reduction(times, reads, recordings[0].rate_hz, band_hz=LENGTH_BAND_HZ)
    with one_blas_thread():
        fit = _Calibration(flights, regressors, reduction)
        found = fit.solve()
    field = fit.field(found)
    _check(field, recordings)
    return field


class _Calibration:
    """Gauss-Newton on direction and length."""

    def __init__(self, flights: Sequence[_Flight], regressors: Regressors, reduction: Reduction) -> None:
        self.flights, self.regressors, self.reduction = flights, regressors, reduction
        start = np.vstack([self._raw(flight, 0.0, 0.0) for flight in flights])
        self.mean, self.scale = start.mean(axis=0), start.std(axis=0)
        self.mean[0], self.scale[0] = 0.0, 1.0
        self.scale[self.scale == 0.0] = 1.0
        self.length_nt = float("nan")

    def _raw(self, flight: _Flight, lag_s: float, curvature_s2: float) -> np.ndarray:
        return self.regressors(flight.recording, lag_s, curvature_s2, 0, flight.channels)

    def design(self, flight: _Flight, lag_s: float, curvature_s2: float) -> np.ndarray:
        """Return the scaled columns of a flight."""
        return (self._raw(flight, lag_s, curvature_s2) - self.mean) / self.scale

    def field(self, found: _Unknowns) -> CalibratedField:
        """Return what was found, for columns as they are."""
        matrix = found.matrix / self.scale[:, None]
        matrix[0] -= self.mean @ matrix
        return CalibratedField(
            self.regressors, matrix, found.lag_s, found.curvature_s2, found.offsets_n, self.length_nt
        )

    def solve(self) -> _Unknowns:
        """Find the unknowns."""
        found = self._start()
        deviation = None
        for _ in range(_STEPS):
            found, deviation = self._step(found, deviation)
        self.length_nt = deviation if deviation is not None else float("nan")
        return found

    def _start(self) -> _Unknowns:
        """Fit the direction alone; the coefficients of the derivative tell the lag."""
        target = np.vstack([flight.aligned.field_b[::_EVERY] for flight in self.flights])
        lag_s = 0.0
        for _ in range(2):
            design = np.vstack([self.design(flight, lag_s, 0.0)[::_EVERY] for flight in self.flights])
            matrix = np.linalg.lstsq(design, target, rcond=None)[0]
            gain, rate = matrix[1:4] / self.scale[1:4, None], matrix[4:7] / self.scale[4:7, None]
            lag_s += float(np.trace(np.linalg.solve(gain, rate))) / 3.0
            lag_s = float(np.clip(lag_s, -MOST_LAG_S, MOST_LAG_S))
        matrix[4:7] = 0.0
        return _Unknowns(matrix, np.zeros((len(self.flights), 3)), lag_s, 0.0)

    def _step(self, found: _Unknowns, deviation: float | None) -> tuple[_Unknowns, float]:
        """Take one Gauss-Newton step; returns also the deviation of the lengths before it."""
        vector = found.as_vector()
        prior = self._prior(len(vector))
        normal, right = np.diag(prior), -prior * vector
        tables = []
        for number, flight in enumerate(self.flights):
            rows, rest, table = self._equations(number, flight, found)
            normal += rows.T @ rows / INS_NT**2
            right += rows.T @ rest / INS_NT**2
            tables.append(table)
        reduced = self.reduction(tables)
        jacobian, rest = reduced[:, :-1], reduced[:, -1]
        now = float(np.sqrt(np.mean(rest**2)))
        # the first step is far from the end: what it misses is no noise
        weight = 1.0 / ((0.3 if deviation is None else max(now, 0.01)) ** 2 * self.reduction.per_row)
        normal += weight * jacobian.T @ jacobian
        right += weight * jacobian.T @ rest
        scale = np.sqrt(np.diag(normal))
        step = np.linalg.solve(normal / scale[:, None] / scale, right / scale) / scale
        return found.moved(step), now

    def _prior(self, count: int) -> np.ndarray:
        """Return the inverse variances of all unknowns."""
        each = np.zeros(self.regressors.count)
        each[4:7] = 1.0 / (RATE_S * self.scale[4:7]) ** 2
        each[7:] = 1.0 / CHANNEL_NT**2
        prior = np.full(count, 1.0 / OFFSET_NT**2)
        prior[: 3 * len(each)] = np.tile(each, 3)
        prior[-2:] = 1.0 / LAG_S**2, 1.0 / CURVATURE_S2**2
        return prior

    def _equations(self, number: int, flight: _Flight, found: _Unknowns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return Jacobian and rest of some directions, and a table of the same for the lengths of all rows."""
        columns = self.regressors.count
        design = self.design(flight, found.lag_s, found.curvature_s2)
        background = design @ found.matrix
        turned = rotate_back(flight.aligned.rot_nb, found.offsets_n[number])
        rate, bend = self._derivatives(flight, found)
        offset = slice(3 * columns + 3 * number, 3 * columns + 3 * number + 3)
        some = slice(None, None, _EVERY)
        rows = np.zeros((len(background[some]), 3, len(found.as_vector())))
        for axis in range(3):
            rows[:, axis, axis * columns : (axis + 1) * columns] = design[some]
        rows[:, :, offset] = -np.swapaxes(flight.aligned.rot_nb[some], 1, 2)
        rows[:, :, -2], rows[:, :, -1] = rate[some], bend[some]
        rest = (flight.aligned.field_b + turned - background)[some].ravel()

        # by its logarithm: the plain length would shrink the background to shrink the noise of the fluxgate
        length = np.linalg.norm(background, axis=1)
        mean = float(length.mean())
        along = background * (mean / length**2)[:, None]
        table = np.zeros((rows.shape[2] + 1, len(background)))
        lines = np.ascontiguousarray(design.T)
        for axis in range(3):
            np.multiply(lines, along[:, axis], out=table[axis * columns : (axis + 1) * columns])
        table[-3] = np.einsum("ni,ni->n", along, rate)
        table[-2] = np.einsum("ni,ni->n", along, bend)
        if flight.length_nt is not None:
            known = np.where(flight.length_nt > 0.0, flight.length_nt, length)  # a dropout is cut out later
        else:
            model = flight.aligned.field_n + found.offsets_n[number]
            known = np.linalg.norm(model, axis=1)
            table[offset] = -(model * (mean / known**2)[:, None]).T
        table[-1] = mean * np.log(known / length)
        return rows.reshape(-1, rows.shape[2]), rest, table

    def _derivatives(self, flight: _Flight, found: _Unknowns) -> tuple[np.ndarray, np.ndarray]:
        """Return how the background changes with lag and with curvature, each (n, 3)."""
        gain = found.matrix[1:4] / self.scale[1:4, None]
        reading = fluxgate_reading(flight.recording, self.regressors.fluxgate)
        out = [np.empty_like(reading), np.empty_like(reading)]
        for span in spans(flight.recording.time_s):
            for order, into in enumerate(out, start=1):
                into[span] = self.regressors.derivative(reading[span], order, found.lag_s, flight.recording.rate_hz)
        return out[0] @ gain, out[1] @ gain


def _check(field: CalibratedField, recordings: Sequence[Recording]) -> None:
    """Refuse what no fluxgate beside an INS can be."""
    worst = int(np.argmax(np.linalg.norm(field.offsets_n, axis=1)))
    offset = field.offsets_n[worst]
    names = ", ".join(repr(recording.name) for recording in recordings)
    if not np.isfinite(field.matrix).all():
        msg = f"fluxgate {field.regressors.fluxgate!r} cannot be calibrated on {names}: its readings do not span space"
        raise DataError(msg)
    if np.linalg.norm(offset) > MOST_OFFSET_NT:
        north, east, down = offset
        msg = (
            f"recording {recordings[worst].name!r}: INS and model field disagree by {north:.0f} nT north, {east:.0f} "
            f"nT east, {down:.0f} nT down; allowed: {MOST_OFFSET_NT:g} nT. Is the heading from grid or magnetic north, "
            "not from true north? Is the date right, and are positions in degrees and heights in meters?"
        )
        raise DataError(msg)
    if abs(field.lag_s) >= MOST_LAG_S:
        msg = (
            f"fluxgate {field.regressors.fluxgate!r} is {field.lag_s:.2f} s late against the INS on {names}; allowed: "
            f"less than {MOST_LAG_S:g} s. Align their time tags first"
        )
        raise DataError(msg)
