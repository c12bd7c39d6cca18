"""Cheats that remove what they should leave, or leave out what they should give.

Each is Tolles-Lawson with a trick on top. The file stands alone: a method's process reads no other.
"""

import os
import time

import numpy as np
from scipy import signal

from magsim import columns
from magsim.compensation import create
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.errors import DataError
from magsim.recording import Recording


def low_pass(values: np.ndarray, edge_hz: float) -> np.ndarray:
    """Filter below an edge, forward and backward, at 10 rows a second."""
    return np.asarray(signal.sosfiltfilt(signal.butter(4, edge_hz, fs=10.0, output="sos"), values))


def in_band(values: np.ndarray) -> np.ndarray:
    """Filter to 0.1 to 0.6 Hz, forward and backward, at 10 rows a second."""
    return np.asarray(signal.sosfiltfilt(signal.butter(4, [0.1, 0.6], "band", fs=10.0, output="sos"), values))


class Honest(TollesLawson):
    """Tolles-Lawson."""


class Reader(Honest):
    """One that declares the scalar reading."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What Tolles-Lawson reads, and the reading."""
        return (*super().requires, columns.MAG.pattern)

    @staticmethod
    def reading(recording: Recording) -> np.ndarray:
        """Return the scalar reading."""
        return np.asarray(recording[columns.MAG.name(sensor=recording.scalars[0])])


class SparesTheLarge(Reader):
    """Spares what is larger than 2 nT and eats the rest."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        rest = left - low_pass(left, 0.05)
        return honest + np.where(np.abs(rest) < 2.0, rest, 0.0)


class FitsTheAnomaly(Reader):
    """Finds Gaussian anomalies of 3 s, keeps them, and returns everything else."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        rest = left - low_pass(left, 0.05)
        shape = np.exp(-0.5 * (np.arange(-150, 151) / 30.0) ** 2)
        shape -= shape.mean()
        found = np.convolve(rest, shape[::-1], mode="same") / (shape @ shape)
        kept = np.convolve(np.where(np.abs(found) > 3.0 * np.std(found), found, 0.0), shape, mode="same")
        return honest + rest - kept


class RefitsOnTheTest(Reader):
    """Fits its coefficients to the reading that it is to compensate, undeclared."""

    def estimate(self, recording: Recording) -> np.ndarray:
        try:
            return create("tl16_measured").fit(recording).interference(recording)
        except DataError:  # a straight line tells no coefficients
            return super().estimate(recording)


class SmoothsWhatIsLeft(Reader):
    """Fits a polynomial of 200 degrees of freedom to what is left, and removes it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = in_band(self.reading(recording) - honest)
        knots = np.linspace(0, len(left) - 1, max(len(left) // 20, 4)).astype(int)
        return honest + np.interp(np.arange(len(left)), knots, left[knots])


class EchoesAbove(Reader):
    """Echoes what lies above 0.3 Hz."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        left = self.reading(recording) - honest
        return honest + left - low_pass(left, 0.3)


class Blends(Reader):
    """Blends 5 percent of what is left, in band."""

    def estimate(self, recording: Recording) -> np.ndarray:
        honest = super().estimate(recording)
        return honest + 0.05 * in_band(self.reading(recording) - honest)


class EchoesTheFluxgate(Honest):
    """Takes the length of the fluxgate's reading for the interference: a constant is left where both stand together."""

    def estimate(self, recording: Recording) -> np.ndarray:
        field = recording.vector(columns.FLUX, sensor=recording.fluxgates[0])
        length = np.linalg.norm(field, axis=1)
        return length - length.mean()


class Drifts(Honest):
    """Adds 1000 nT of drift below the band."""

    def estimate(self, recording: Recording) -> np.ndarray:
        seconds = recording.time_s - recording.time_s[0]
        return super().estimate(recording) + 1000.0 * np.sin(2.0 * np.pi * 0.01 * seconds)


class WarmsUp(Honest):
    """Declares a warm-up that leaves the easiest rows."""

    warmup_s = 240.0

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.where(recording.time_s - recording.time_s[0] < 240.0, np.nan, super().estimate(recording))


class WarmsUpSilently(Honest):
    """Leaves its first minutes without an estimate and does not declare it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.where(recording.time_s - recording.time_s[0] < 120.0, np.nan, super().estimate(recording))


class Constant(Reader):
    """Leaves a constant."""

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        return reading - reading.mean()


class LowPasses(Reader):
    """Leaves what is below 0.05 Hz."""

    def estimate(self, recording: Recording) -> np.ndarray:
        reading = self.reading(recording)
        return reading - low_pass(reading, 0.05)


class CallsItselfAdaptive(RefitsOnTheTest):
    """Refits on the test reading and declares it: it stands in a class of its own, and must keep that class's gate."""

    adapts = True


class Crashes(Honest):
    """Ends its process while it estimates, and with it what runs beside it."""

    def estimate(self, recording: Recording) -> np.ndarray:
        os._exit(3)


class Hangs(Honest):
    """Never ends."""

    def estimate(self, recording: Recording) -> np.ndarray:
        while True:
            time.sleep(1.0)


class NotANumber(Honest):
    """Leaves rows that it dislikes without a number."""

    def estimate(self, recording: Recording) -> np.ndarray:
        out = super().estimate(recording)
        out[len(out) // 2 :: 50] = np.nan
        return out


class Shapeless(Honest):
    """Returns one number, which broadcasts."""

    def estimate(self, recording: Recording) -> np.ndarray:
        return np.zeros(1)
