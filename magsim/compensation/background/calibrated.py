"""The background from a fluxgate that was calibrated against the INS and the model of the main field."""

from dataclasses import dataclass

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

    def channels_of(self, recording: Recording) -> np.ndarray:
        """Return the channels of a recording, (n, k)."""
        out = np.empty((len(recording), len(self.channels)))
        for column, channel in enumerate(self.channels):
            out[:, column] = channel(recording)
        return out

    def __call__(
        self,
        recording: Recording,
        lag_s: float,
        curvature_s2: float,
        order: int = 0,
        channels: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the columns or a derivative of them by time, (n, count).

        Parameters
        ----------
        recording : Recording
        lag_s : float [s]
            How late the fluxgate is.
        curvature_s2 : float [s^2]
            What of the second derivative is added: the bandwidth of the fluxgate.
        order : int
            0, 1 or 2.
        channels : (n, k), optional
            What ``channels_of`` gives, where it is at hand.
        """
        reading = fluxgate_reading(recording, self.fluxgate)
        rate_hz = recording.rate_hz
        out = np.empty((len(recording), self.count))
        out[:, 0] = 0.0 if order else 1.0
        channels = self.channels_of(recording) if channels is None else channels
        for span in signals.spans(recording.time_s):
            out[span, 1:4] = self.derivative(reading[span], order, lag_s, rate_hz)
            out[span, 4:7] = self.derivative(reading[span], order + 1, lag_s, rate_hz)
            if not order:  # of no account in a derivative
                out[span, 1:4] += curvature_s2 * self.derivative(reading[span], 2, lag_s, rate_hz)
            out[span, 7:] = self.derivative(channels[span], order, 0.0, rate_hz) if order else channels[span]
        return out

    def derivative(self, values: np.ndarray, order: int, lag_s: float, rate_hz: float) -> np.ndarray:
        """Return a derivative of a piece by time, a lag later, (n, ...)."""
        return taps(order, lag_s, self.lookahead_rows, round(rate_hz, 6))(values)


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
        return self.derivative(recording, 0)

    def motion(self, recording: Recording, later_s: float = 0.0) -> list[np.ndarray]:
        """Return the background and its first two derivatives, each (n, 3); see ``derivative``."""
        channels = self.regressors.channels_of(recording)
        return [self.derivative(recording, order, later_s, channels) for order in range(3)]

    def derivative(
        self, recording: Recording, order: int, later_s: float = 0.0, channels: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the background or a derivative of it by time, (n, 3) [nT, nT/s, nT/s^2].

        Parameters
        ----------
        recording : Recording
        order : int
            0, 1 or 2.
        later_s : float [s]
            How much later than its row it is wanted.
        channels : (n, k), optional
            See ``Regressors``.
        """
        design = self.regressors(recording, self.lag_s + later_s, self.curvature_s2, order, channels)
        with one_blas_thread():
            return design @ self.matrix

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
