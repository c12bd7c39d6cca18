"""The background from a fluxgate that was calibrated against the INS and the model of the main field."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.compensation.background.channels import Channel
from magsim.compensation.background.rows import CalibratedRows
from magsim.compensation.background.taps import taps
from magsim.compensation.columns.direction import pick_fluxgate
from magsim.compensation.saving import State
from magsim.compensation.streaming.protocol import Feed
from magsim.errors import DataError
from magsim.recording import Recording
from magsim.threads import one_blas_thread


class Readings(NamedTuple):
    """What regressors read of a recording.

    Attributes
    ----------
    flux : (n, 3) [nT]
        The fluxgate.
    channels : (n, k)
    spans : list of slice
        Rows without a gap.
    rate_hz : float
    """

    flux: np.ndarray
    channels: np.ndarray
    spans: list[slice]
    rate_hz: float


@dataclass(frozen=True)
class Regressors:
    """What the background is a linear function of: a constant, the fluxgate, its derivative, channels.

    Attributes
    ----------
    fluxgate : str
    channels : tuple of Channel
        Currents and deflections that the fluxgate sees.
    lookahead_rows : int
        Rows after its own that a row needs.
    """

    fluxgate: str
    channels: tuple[Channel, ...]
    lookahead_rows: int

    @property
    def count(self) -> int:
        """Number of columns."""
        return 7 + len(self.channels)

    def read(self, recording: Recording) -> Readings:
        """Return fluxgate and channels of a recording; see ``fluxgate_reading`` and ``Channel`` for what is raised."""
        channels = np.empty((len(recording), len(self.channels)))
        for column, channel in enumerate(self.channels):
            channels[:, column] = channel(recording)
        flux = fluxgate_reading(recording, self.fluxgate)
        return Readings(flux, channels, signals.spans(recording.time_s), round(recording.rate_hz, 6))

    def derivative(self, readings: Readings, values: np.ndarray, order: int, lag_s: float) -> np.ndarray:
        """Return a derivative of a series by time, a lag later, (n, ...); order 0 is the series itself."""
        filtered = taps(order, lag_s, self.lookahead_rows, readings.rate_hz)
        out = np.empty_like(values)
        for span in readings.spans:
            out[span] = filtered(values[span])
        return out

    def fluxgate_motion(self, readings: Readings, lag_s: float, orders: int) -> list[np.ndarray]:
        """Return the fluxgate and its derivatives by time, a lag later, (n, 3) each."""
        return [self.derivative(readings, readings.flux, order, lag_s) for order in range(orders)]


def fluxgate_reading(recording: Recording, fluxgate: str) -> np.ndarray:
    """Return the reading of a fluxgate, (n, 3) [nT].

    Raises
    ------
    RequestError
        If the recording has no such fluxgate.
    DataError
        If a value is not finite.
    """
    pick_fluxgate([recording], fluxgate)
    reading = recording.vector(columns.FLUX, sensor=fluxgate)
    bad = ~np.isfinite(reading).all(axis=1)
    if bad.any():
        when = recording.time_s[np.argmax(bad)]
        msg = f"recording {recording.name!r}: fluxgate {fluxgate!r} is not finite at {when:g} s"
        raise DataError(msg)
    return reading


@dataclass(frozen=True, eq=False)
class CalibratedField:
    """The background in body axes as a linear function of fluxgate and channels.

    Attributes
    ----------
    regressors : Regressors
    matrix : (c, 3) [nT per unit of the columns]
    lag_s, curvature_s2 : float
        See ``Regressors``.
    offsets_n : (flights, 3) [nT]
        What the Earth's field is more than the model on each training flight, in local axes.
    length_nt : float [nT]
        What the length of the background missed on the training flights, in 0.02 to 1 Hz.
    """

    regressors: Regressors
    matrix: np.ndarray
    lag_s: float
    curvature_s2: float
    offsets_n: np.ndarray
    length_nt: float

    @property
    def reads(self) -> tuple[str, ...]:
        """The fluxgate, and the families of the channels."""
        families = (columns.family_of(channel.name).pattern for channel in self.regressors.channels)
        return tuple(dict.fromkeys((columns.FLUX.pattern, *families)))

    @property
    def lookahead_rows(self) -> int:
        """Rows after its own that a row needs."""
        return self.regressors.lookahead_rows

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the background in body axes, (n, 3) [nT]."""
        return self.motion(self.regressors.read(recording), orders=1)[0]

    def motion(self, readings: Readings, later_s: float = 0.0, orders: int = 3) -> list[np.ndarray]:
        """Return the background and its derivatives by time, (n, 3) each [nT, nT/s, nT/s^2].

        Parameters
        ----------
        readings : Readings
        later_s : float [s]
            How much later than its row it is wanted.
        orders : int
            How many of them: 1 the background alone, to 3.
        """
        flux = self.regressors.fluxgate_motion(readings, self.lag_s + later_s, max(orders + 1, 3))
        gain, rate = self.matrix[1:4], self.matrix[4:7]
        with one_blas_thread():
            seen = readings.channels @ self.matrix[7:]
            found = [(flux[0] + self.curvature_s2 * flux[2]) @ gain + flux[1] @ rate + self.matrix[0] + seen]
            # the curvature is of no account in a derivative
            found += [flux[order] @ gain + flux[order + 1] @ rate for order in range(1, orders)]
        for order in range(1, orders if readings.channels.shape[1] else 0):
            found[order] += self.regressors.derivative(readings, seen, order, 0.0)
        return found

    def rows(self, feed: Feed) -> CalibratedRows:
        """Return the background row by row."""
        known, rate_hz = self.regressors, round(feed.rate_hz, 6)
        value, change, bend = (taps(order, self.lag_s, self.lookahead_rows, rate_hz).weights for order in range(3))
        as_is, moving = self.matrix[1:4], self.matrix[4:7]
        weights = (value + self.curvature_s2 * bend)[:, None, None] * as_is + change[:, None, None] * moving
        return CalibratedRows(
            known.fluxgate,
            [channel.rows(feed.rate_hz) for channel in known.channels],
            weights=weights,
            constant=self.matrix[0],
            matrix=self.matrix[7:],
            lookahead_rows=self.lookahead_rows,
        )

    def state(self) -> State:
        """Return what a file needs."""
        values = {
            "direction": "calibrated",
            "fluxgate": self.regressors.fluxgate,
            "channels": [[channel.name, channel.rest] for channel in self.regressors.channels],
            "lookahead_rows": self.lookahead_rows,
            "lag_s": self.lag_s,
            "curvature_s2": self.curvature_s2,
            "length_nt": self.length_nt,
        }
        return State(values, {"background": self.matrix, "offsets_n": self.offsets_n})

    @classmethod
    def of(cls, state: State) -> "CalibratedField":
        """Make what ``state`` returned; a ``KeyError`` or ``ValueError`` means that the file is broken."""
        values = state.values
        channels = tuple(Channel(str(name), None if rest is None else float(rest)) for name, rest in values["channels"])
        regressors = Regressors(str(values["fluxgate"]), channels, int(values["lookahead_rows"]))
        matrix = np.asarray(state.arrays["background"], dtype=float)
        if matrix.shape != (regressors.count, 3):
            msg = f"a background of shape {matrix.shape} for {regressors.count} columns"
            raise ValueError(msg)
        return cls(
            regressors,
            matrix,
            float(values["lag_s"]),
            float(values["curvature_s2"]),
            np.asarray(state.arrays["offsets_n"], dtype=float),
            float(values["length_nt"]),
        )
