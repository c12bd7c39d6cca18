"""Twins of a flight: the same recording over other ground, which a compensator must leave unharmed.

A twin differs by anomalies alone, of one height. Places, widths, shapes and signs are drawn, so that no method can know
them; what a method makes of them is scored by the difference between its two answers, into which what it leaves of the
aircraft cannot leak.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from magsim import columns, signals
from magsim.recording import Recording

PEAKS_NT = (0.1, 1.0, 20.0)
"""Heights of anomalies, of which a twin has one."""

WIDTHS_S = (0.3, 10.0)
"""Of the Gaussians that anomalies are made of, log-uniform: those of 3 s and more have little in band."""

SPACING_S = 25.0
"""Mean time from one anomaly to the next."""


@dataclass(frozen=True)
class Twin:
    """A recording with anomalies.

    Attributes
    ----------
    recording : Recording
    injected : (n,) [nT]
        What was added to the scalar reading.
    peak_nt : float [nT]
        Height of every anomaly; 0 for a twin without any.
    """

    recording: Recording
    injected: np.ndarray
    peak_nt: float


def twin_of(recording: Recording, sensor: str, rng: np.random.Generator, peak_nt: float) -> Twin:
    """Return a twin of a recording.

    The anomaly is added to the scalar reading and, along the field that each fluxgate reads, to its axes: as a field
    that is small beside the Earth's, it lengthens both by the same. Base stations do not see it.

    Parameters
    ----------
    recording : Recording
    sensor : str
        The scalar magnetometer.
    rng : numpy.random.Generator
        Draws the anomalies.
    peak_nt : float [nT]
        Height of the anomalies; 0 for none.
    """
    injected = np.zeros(len(recording))
    if peak_nt > 0.0:
        # by place: pieces would take rows of all columns
        for rows in signals.spans(recording.time_s):
            injected[rows] = anomalies(recording.time_s[rows], rng, peak_nt)
    mag = columns.MAG.name(sensor=sensor)
    changed = {mag: recording[mag] + injected} if mag in recording else {}
    for fluxgate in recording.fluxgates:
        names = [columns.FLUX.name(sensor=fluxgate, axis=axis) for axis in "xyz"]
        field = recording.stack(names)
        length = np.linalg.norm(field, axis=1)
        # a channel that reads nothing stays as it is
        longer = np.divide(injected, length, out=np.zeros(len(length)), where=length > 0.0)
        moved = field * (1.0 + longer)[:, None]
        changed |= dict(zip(names, moved.T, strict=True))
    return Twin(replace(recording, data={**recording.data, **changed}), injected, peak_nt)


def anomalies(time_s: np.ndarray, rng: np.random.Generator, peak_nt: float) -> np.ndarray:
    """Draw anomalies of one height along a piece, (n,) [nT]: Gaussians, and a high beside a low as over a dipole."""
    out = np.zeros(len(time_s))
    for center in _centers(time_s, rng):
        width = float(np.exp(rng.uniform(*np.log(WIDTHS_S))))
        shape = _shape((time_s - center) / width, pair=bool(rng.integers(2)))
        out += peak_nt * float(rng.choice([-1.0, 1.0])) * shape
    return out


def _centers(time_s: np.ndarray, rng: np.random.Generator) -> Sequence[float]:
    """Return places, one in each stretch of equal length; one at least."""
    length = float(time_s[-1] - time_s[0])
    count = max(round(length / SPACING_S), 1)
    places = (np.arange(count) + rng.uniform(0.15, 0.85, count)) / count
    return [float(time_s[0] + place * length) for place in places]


def _shape(x: np.ndarray, *, pair: bool) -> np.ndarray:
    """Return a Gaussian of height 1, or its derivative of the same height, which is at one width from the middle."""
    bell = np.exp(-0.5 * x**2)
    return x * bell * np.exp(0.5) if pair else bell
