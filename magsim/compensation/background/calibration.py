"""The fit of a ``CalibratedField``: direction from INS and model field, sharpened by the length of the field.

An INS is wrong by some 0.02 deg, which is 20 nT of direction, slowly. The length of the field is known in the band of
motion to some 0.03 nT, and what turns the whole background at once is of no account for a compensation. So the matrix
is found from the direction first, and then by Gauss-Newton steps from both: direction with a deviation of ``INS_NT``,
length in 0.02 to 1 Hz with the deviation that it turns out to have.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim.compensation.background.calibrated import CalibratedField, Readings, Regressors
from magsim.compensation.background.model import Aligned, model_along
from magsim.compensation.reduction import Reduction
from magsim.errors import DataError
from magsim.frames import rotate_back
from magsim.recording import Recording
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
_FULL_STEPS = 2
"""Steps that take the derivatives of the lengths anew: in a later one they have changed by 1e-3 or so."""

_EVERY = 10
"""One of so many rows is compared in direction: the INS is wrong slowly."""

_SOME = slice(None, None, _EVERY)


@dataclass(frozen=True)
class _Flight:
    """One training recording as the fit needs it."""

    readings: Readings
    some: Aligned
    """Model field in one of ``_EVERY`` rows."""
    length_nt: np.ndarray | None
    """Length of the background where the labels tell it."""
    model_n: np.ndarray | None
    """Model field in every row, where they do not."""

    @classmethod
    def of(cls, recording: Recording, readings: Readings, length_nt: np.ndarray | None) -> "_Flight":
        """Take what is needed of a recording."""
        if length_nt is not None:
            return cls(readings, model_along(recording, _SOME), length_nt, None)
        whole = model_along(recording)
        return cls(readings, Aligned(whole.rot_nb[_SOME], whole.field_n[_SOME]), None, whole.field_n)


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


class _Motion(NamedTuple):
    """The background of a flight at the unknowns: scaled columns (c, n), field, and how that changes, (3, n) each."""

    flight: _Flight
    place: int
    lines: np.ndarray
    field: np.ndarray
    rate: np.ndarray
    bend: np.ndarray


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
        _Flight.of(recording, regressors.read(recording), length)
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
    """Gauss-Newton on direction and length. Columns of the matrix are in lines, (c, n)."""

    def __init__(self, flights: Sequence[_Flight], regressors: Regressors, reduction: Reduction) -> None:
        self.flights, self.regressors, self.reduction = flights, regressors, reduction
        self.mean, self.scale = np.zeros(regressors.count), np.ones(regressors.count)
        raw = [self._lines(flight, regressors.fluxgate_motion(flight.readings, 0.0, 2), 0.0) for flight in flights]
        start = np.concatenate(raw, axis=1)
        self.mean[1:], self.scale[1:] = start[1:].mean(axis=1), start[1:].std(axis=1)
        self.scale[self.scale == 0.0] = 1.0
        self.length_nt = float("nan")
        self._slopes = np.zeros((0, 0))
        self._products = self._slopes

    def _lines(self, flight: _Flight, flux: Sequence[np.ndarray], curvature_s2: float) -> np.ndarray:
        """Return the scaled columns of a flight for the fluxgate and its derivatives."""
        reading = flux[0] + curvature_s2 * flux[2] if curvature_s2 else flux[0]
        out = np.empty((self.regressors.count, len(reading)))
        out[0] = 1.0
        for first, values in ((1, reading), (4, flux[1]), (7, flight.readings.channels)):
            own = slice(first, first + values.shape[1])
            np.subtract(values.T, self.mean[own, None], out=out[own])
            out[own] /= self.scale[own, None]
        return out

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
        for number in range(_STEPS):
            found = self._step(found, number)
        return found

    def _start(self) -> _Unknowns:
        """Fit the direction alone; the coefficients of the derivative tell the lag."""
        target = np.vstack([flight.some.field_b for flight in self.flights])
        lag_s = 0.0
        for _ in range(2):
            lines = [self._lines(f, self.regressors.fluxgate_motion(f.readings, lag_s, 2), 0.0) for f in self.flights]
            design = np.concatenate([part[:, _SOME] for part in lines], axis=1).T
            matrix = np.linalg.lstsq(design, target, rcond=None)[0]
            gain, rate = matrix[1:4] / self.scale[1:4, None], matrix[4:7] / self.scale[4:7, None]
            lag_s += float(np.trace(np.linalg.solve(gain, rate))) / 3.0
            lag_s = float(np.clip(lag_s, -MOST_LAG_S, MOST_LAG_S))
        matrix[4:7] = 0.0
        return _Unknowns(matrix, np.zeros((len(self.flights), 3)), lag_s, 0.0)

    def _step(self, found: _Unknowns, number: int) -> _Unknowns:
        """Take one Gauss-Newton step; the later ones with the derivatives of the lengths from the step before."""
        vector = found.as_vector()
        prior = self._prior(len(vector))
        normal, right = np.diag(prior), -prior * vector
        slopes, rests = [], []
        for place, flight in enumerate(self.flights):
            motion = self._motion(flight, place, found)
            self._add_direction(motion, found, normal, right)
            slope, rest = self._lengths(motion, found, with_slopes=number < _FULL_STEPS)
            slopes.append(slope)
            rests.append(rest)
        if number < _FULL_STEPS:
            self._slopes = self.reduction(slopes)
            self._products = self._slopes.T @ self._slopes
        rest = self.reduction(rests)[:, 0]
        self.length_nt = float(np.sqrt(np.mean(rest**2)))
        # the first step is far from the end: what it misses is no noise
        noise_nt = max(self.length_nt, 0.01) if number else 0.3
        weight = 1.0 / (noise_nt**2 * self.reduction.per_row)
        normal += weight * self._products
        right += weight * (self._slopes.T @ rest)
        scale = np.sqrt(np.diag(normal))
        step = np.linalg.solve(normal / scale[:, None] / scale, right / scale) / scale
        return found.moved(step)

    def _prior(self, count: int) -> np.ndarray:
        """Return the inverse variances of all unknowns."""
        each = np.zeros(self.regressors.count)
        each[4:7] = 1.0 / (RATE_S * self.scale[4:7]) ** 2
        each[7:] = 1.0 / CHANNEL_NT**2
        prior = np.full(count, 1.0 / OFFSET_NT**2)
        prior[: 3 * len(each)] = np.tile(each, 3)
        prior[-2:] = 1.0 / LAG_S**2, 1.0 / CURVATURE_S2**2
        return prior

    def _motion(self, flight: _Flight, place: int, found: _Unknowns) -> _Motion:
        """Return the background at the unknowns, and how it changes with them."""
        flux = self.regressors.fluxgate_motion(flight.readings, found.lag_s, 3)
        lines = self._lines(flight, flux, found.curvature_s2)
        gain = found.matrix[1:4] / self.scale[1:4, None]
        return _Motion(flight, place, lines, found.matrix.T @ lines, gain.T @ flux[1].T, gain.T @ flux[2].T)

    def _add_direction(self, motion: _Motion, found: _Unknowns, normal: np.ndarray, right: np.ndarray) -> None:
        """Add the normal equations of the direction in some rows of a flight: each axis has a matrix of its own."""
        columns = self.regressors.count
        lines, rows = motion.lines[:, _SOME], motion.flight.some
        turned = rotate_back(rows.rot_nb, found.offsets_n[motion.place])
        rest = (rows.field_b + turned).T - motion.field[:, _SOME]
        shared = lines @ lines.T / INS_NT**2
        # offset of the flight, lag, curvature
        first = 3 * columns + 3 * motion.place
        few = [first, first + 1, first + 2, len(right) - 2, len(right) - 1]
        for axis in range(3):
            others = np.vstack([-rows.rot_nb[:, :, axis].T, motion.rate[axis, _SOME], motion.bend[axis, _SOME]])
            own = slice(axis * columns, (axis + 1) * columns)
            normal[own, own] += shared
            crossed = lines @ others.T / INS_NT**2
            normal[own, few] += crossed
            normal[few, own] += crossed.T
            normal[np.ix_(few, few)] += others @ others.T / INS_NT**2
            right[own] += lines @ rest[axis] / INS_NT**2
            right[few] += others @ rest[axis] / INS_NT**2

    def _lengths(self, motion: _Motion, found: _Unknowns, *, with_slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return derivatives of the length of all rows by the unknowns, (u, n) or none, and what is missed, (1, n).

        By its logarithm: the plain length would shrink the background to shrink the noise of the fluxgate.
        """
        columns, field, flight, place = self.regressors.count, motion.field, motion.flight, motion.place
        length = np.sqrt(np.einsum("in,in->n", field, field))
        mean = float(length.mean())
        if flight.length_nt is not None:
            known = np.where(flight.length_nt > 0.0, flight.length_nt, length)  # a dropout is cut out later
        else:
            assert flight.model_n is not None
            model = flight.model_n + found.offsets_n[place]
            known = np.linalg.norm(model, axis=1)
        rest = mean * np.log(known / length)
        if not with_slopes:
            return np.zeros((0, len(rest))), rest[None]
        along = field * (mean / length**2)
        table = np.zeros((len(found.as_vector()), len(length)))
        for axis in range(3):
            np.multiply(motion.lines, along[axis], out=table[axis * columns : (axis + 1) * columns])
        if flight.length_nt is None:
            first = 3 * columns + 3 * place
            table[first : first + 3] = -(model * (mean / known**2)[:, None]).T
        table[-2] = np.einsum("in,in->n", along, motion.rate)
        table[-1] = np.einsum("in,in->n", along, motion.bend)
        return table, rest[None]


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
