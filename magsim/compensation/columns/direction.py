"""The direction of the field in the axes of a fluxgate, and its derivative by time."""

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np

from magsim import columns, signals
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

Derivative = Literal["central", "spline"]


def pick_fluxgate(recordings: Sequence[Recording], wanted: str | None = None) -> str:
    """Return the fluxgate to use: the named one, else the first of the first recording.

    Raises
    ------
    RequestError
        If a recording does not have it.
    """
    found = wanted or next(iter(recordings[0].fluxgates), None)
    for recording in recordings:
        if found is None or found not in recording.fluxgates:
            has = ", ".join(recording.fluxgates) or "none"
            msg = f"recording {recording.name!r} has no fluxgate {found or ''!r}; it has {has}"
            raise RequestError(msg)
    return str(found)


class VectorField(Protocol):
    """Makes vectors of a recording whose direction and length columns are made of: a background."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""

    @property
    def lookahead_rows(self) -> int:
        """Rows after its own that a row needs."""

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return vectors, (n, 3) [nT]."""


def mean_strength(recordings: Sequence[Recording], fluxgate: str) -> float:
    """Return the mean length of a fluxgate's reading over recordings [nT]."""
    return mean_length([r.vector(columns.FLUX, sensor=fluxgate) for r in recordings])


def mean_length(vectors: Sequence[np.ndarray]) -> float:
    """Return the mean length of vectors, (n, 3) each."""
    return float(np.concatenate([np.linalg.norm(each, axis=1) for each in vectors]).mean())


def direction_cosines(recording: Recording, fluxgate: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction of the field in sensor axes, (n, 3), and its length, (n,) [nT].

    Raises
    ------
    RequestError
        If the recording has no such fluxgate.
    DataError
        If a reading is not finite or zero.
    """
    pick_fluxgate([recording], fluxgate)
    return unit_vectors(recording.vector(columns.FLUX, sensor=fluxgate), recording, f"fluxgate {fluxgate!r}")


def unit_vectors(vectors: np.ndarray, recording: Recording, words: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction of vectors, (n, 3), and their length, (n,).

    Raises
    ------
    DataError
        If one is not finite or zero; ``words`` say of what.
    """
    length = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
    bad = ~(np.isfinite(length) & (length > 0.0))
    if bad.any():
        when = recording.time_s[np.argmax(bad)]
        msg = f"recording {recording.name!r}: {words} has no direction at {when:g} s"
        raise DataError(msg)
    return vectors / length[:, None], length


def time_derivative(values: np.ndarray, time_s: np.ndarray, method: Derivative = "central") -> np.ndarray:
    """Differentiate by time, never across a gap; a row that stands alone has 0.

    Parameters
    ----------
    values : (n, ...)
    time_s : (n,) [s]
    method : {"central", "spline"}
        Central differences, or the cubic spline through the samples.

    Returns
    -------
    (n, ...) [unit of values / s]
    """
    rate_hz = 1.0 / signals.median_step(time_s)
    out = np.zeros_like(values)
    for span in signals.spans(time_s):
        count = span.stop - span.start
        if count >= 4 and method == "spline":
            out[span] = signals.spline_derivative(values[span], rate_hz)
        elif count >= 2:
            out[span] = signals.derivative(values[span], rate_hz)
    return out
