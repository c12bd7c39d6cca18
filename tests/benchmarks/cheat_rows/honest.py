"""A small Tolles-Lawson method that the cheats begin with: what they fall back to where their trick has no effect."""

from typing import ClassVar

import numpy as np
from scipy import signal

from magsim import columns
from magsim.compensation import Compensator, FitContext
from magsim.dataset import Training
from magsim.recording import Recording

FLUX, MAG = columns.FLUX.pattern, columns.MAG.pattern


def terms(recording: Recording) -> np.ndarray:
    """Return permanent, induced and eddy columns by the fluxgate's direction, (n, 18)."""
    field = recording.vector(columns.FLUX, sensor=recording.fluxgates[0])
    length = np.linalg.norm(field, axis=1, keepdims=True)
    u = field / length
    rate = np.gradient(u, recording.time_s, axis=0)
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    induced = np.stack([u[:, i] * u[:, j] for i, j in pairs], axis=1)
    eddy = np.stack([u[:, i] * rate[:, j] for i in range(3) for j in range(3)], axis=1)
    return np.hstack([u, induced * length.mean(), eddy * length.mean()])


def in_band(values: np.ndarray) -> np.ndarray:
    """Filter to 0.1 to 0.6 Hz, forward and backward, at 10 rows a second."""
    sections = signal.butter(4, [0.1, 0.6], btype="band", fs=10.0, output="sos")
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0))


def least_squares(recordings: list[Recording], targets: list[np.ndarray]) -> np.ndarray:
    """Return the coefficients of the 18 columns for targets, in band."""
    design = np.concatenate([in_band(terms(one))[100:-100] for one in recordings])
    target = np.concatenate([in_band(one)[100:-100] for one in targets])
    scale = np.linalg.norm(design, axis=0)
    return np.asarray(np.linalg.lstsq(design / scale, target, rcond=1e-9)[0] / scale)


class Honest(Compensator):
    """Tolles-Lawson by least squares."""

    name = "honest"
    requires: ClassVar[tuple[str, ...]] = (FLUX,)
    lookahead_rows = None
    coefficients_: np.ndarray

    def learn(self, training: Training, context: FitContext) -> None:
        """Fit to the label, or to the reading where there is none."""
        label = columns.INTERFERENCE.name(sensor=training.sensor)
        reading = columns.MAG.name(sensor=training.sensor)
        flights = [piece for recording in training.recordings for piece in recording.pieces() if len(piece) > 400]
        self.coefficients_ = least_squares(flights, [one[label if label in one else reading] for one in flights])

    def estimate(self, recording: Recording) -> np.ndarray:
        """Estimate by the columns."""
        return terms(recording) @ self.coefficients_


class Reader(Honest):
    """One that declares the scalar reading."""

    requires: ClassVar[tuple[str, ...]] = (FLUX, MAG)

    @staticmethod
    def reading(recording: Recording) -> np.ndarray:
        """Return the scalar reading."""
        return np.asarray(recording[columns.MAG.name(sensor=recording.scalars[0])])
