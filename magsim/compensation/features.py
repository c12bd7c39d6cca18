"""Input columns of the compensators, formed from the inputs of a recording alone.

The Tolles-Lawson columns follow paper 000, eq. 26, with its typo resolved (the last entry is u3 u2'). The scalar
reading itself is never a feature: a method that needs it must declare it.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from magsim import columns, signals
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

Derivative = Literal["central", "spline"]

INDUCED_18 = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
EDDY_18 = ((0, 0), (1, 0), (2, 0), (0, 2), (1, 2), (2, 2), (0, 1), (1, 1), (2, 1))
"""Pairs (i, j) of the columns u_i u_j and u_i u_j' (paper 001)."""

INDUCED_16 = tuple(pair for pair in INDUCED_18 if pair != (1, 1))
EDDY_16 = tuple(pair for pair in EDDY_18 if pair != (1, 1))
"""The same without u2 u2 and u2 u2', which follow from u . u = 1 and u . u' = 0 (paper 000)."""


@dataclass(frozen=True)
class Inputs:
    """How columns are formed.

    Attributes
    ----------
    fluxgate : str
        Name of the fluxgate that gives the direction cosines.
    derivative : {"central", "spline"}
        How the direction cosines are differentiated by time; always per second.
    strength_nt : float [nT], optional
        Field strength in the induced and eddy columns; by default the length of the fluxgate reading, row by row.
    """

    fluxgate: str
    derivative: Derivative = "central"
    strength_nt: float | None = None


class Design(NamedTuple):
    """Columns side by side with their names and units."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    matrix: np.ndarray


def spans(time_s: np.ndarray) -> list[slice]:
    """Parts of a time axis without a jump of more than 1.5 median steps, in order; they cover all rows."""
    steps = np.diff(time_s)
    cuts = np.flatnonzero(steps > 1.5 * np.median(steps)) + 1
    bounds = [0, *cuts.tolist(), len(time_s)]
    return [slice(a, b) for a, b in itertools.pairwise(bounds)]


def direction_cosines(recording: Recording, fluxgate: str) -> tuple[np.ndarray, np.ndarray]:
    """Direction of the field in sensor axes, (n, 3), and its length, (n,) [nT].

    Raises
    ------
    RequestError
        If the recording has no such fluxgate.
    DataError
        If a reading is not finite or zero.
    """
    if fluxgate not in recording.fluxgates:
        has = ", ".join(recording.fluxgates) or "none"
        msg = f"recording {recording.name!r} has no fluxgate {fluxgate!r}; it has {has}"
        raise RequestError(msg)
    reading = recording.vector(columns.FLUX, sensor=fluxgate)
    length = np.sqrt(np.einsum("ni,ni->n", reading, reading))
    bad = ~(np.isfinite(length) & (length > 0.0))
    if bad.any():
        when = recording.time_s[np.argmax(bad)]
        msg = f"recording {recording.name!r}: fluxgate {fluxgate!r} has no direction at {when:g} s"
        raise DataError(msg)
    return reading / length[:, None], length


def time_derivative(values: np.ndarray, time_s: np.ndarray, method: Derivative = "central") -> np.ndarray:
    """Derivative by time [1/s], never across a gap; a row that stands alone has 0."""
    out = np.zeros_like(values)
    rate_hz = 1.0 / np.median(np.diff(time_s))
    for span in spans(time_s):
        count = span.stop - span.start
        if count >= 4 and method == "spline":
            out[span] = signals.spline_derivative(values[span], rate_hz)
        elif count >= 2:
            out[span] = signals.derivative(values[span], rate_hz)
    return out


def tolles_lawson(recording: Recording, inputs: Inputs, terms: int) -> Design:
    """Tolles-Lawson columns in canonical order: 3 permanent, then induced, then eddy.

    Parameters
    ----------
    recording : Recording
    inputs : Inputs
    terms : {16, 18}

    Returns
    -------
    Design
        u_i with coefficients in nT; B u_i u_j without unit; B u_i u_j' [nT/s] with coefficients in s. ``units`` are
        those of the coefficients.
    """
    cosines, length = direction_cosines(recording, inputs.fluxgate)
    rates = time_derivative(cosines, recording.time_s, inputs.derivative)
    strength = length if inputs.strength_nt is None else np.full(len(length), inputs.strength_nt)
    induced, eddy = (INDUCED_16, EDDY_16) if terms == 16 else (INDUCED_18, EDDY_18)
    names = [f"u{i + 1}" for i in range(3)]
    names += [f"B u{i + 1} u{j + 1}" for i, j in induced] + [f"B u{i + 1} u{j + 1}'" for i, j in eddy]
    parts = [cosines]
    parts += [(strength * cosines[:, i] * cosines[:, j])[:, None] for i, j in induced]
    parts += [(strength * cosines[:, i] * rates[:, j])[:, None] for i, j in eddy]
    units = ("nT",) * 3 + ("1",) * len(induced) + ("s",) * len(eddy)
    return Design(tuple(names), units, np.hstack(parts))


def attitude(recording: Recording, inputs: Inputs) -> Design:
    """Roll and pitch [rad], sine and cosine of the heading: an angle that wraps would jump."""
    require(recording, [columns.INS_ATTITUDE.name(angle=angle) for angle in ("roll", "pitch", "heading")])
    roll, pitch, heading = (
        np.radians(recording[columns.INS_ATTITUDE.name(angle=angle)]) for angle in ("roll", "pitch", "heading")
    )
    names = ("roll", "pitch", "sin heading", "cos heading")
    matrix = np.column_stack([roll, pitch, np.sin(heading), np.cos(heading)])
    return Design(names, ("rad", "rad", "1", "1"), matrix)


FEATURE_SETS: dict[str, Callable[[Recording, Inputs], Design]] = {
    "tl16": lambda recording, inputs: tolles_lawson(recording, inputs, 16),
    "tl18": lambda recording, inputs: tolles_lawson(recording, inputs, 18),
    "attitude": attitude,
}
"""Sets of columns by name; a method names the sets it reads."""


def design(recording: Recording, inputs: Inputs, sets: Sequence[str]) -> Design:
    """Several feature sets side by side.

    Raises
    ------
    RequestError
        If the recording lacks a column that a set reads.
    DataError
        If a value is not finite.
    """
    parts = [FEATURE_SETS[name](recording, inputs) for name in sets]
    matrix = np.hstack([part.matrix for part in parts])
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        names = [name for part in parts for name in part.names]
        msg = f"recording {recording.name!r}: {names[column]} is not finite at {recording.time_s[row]:g} s"
        raise DataError(msg)
    return Design(
        tuple(name for part in parts for name in part.names),
        tuple(unit for part in parts for unit in part.units),
        matrix,
    )


def requirements(sets: Sequence[str]) -> tuple[str, ...]:
    """Patterns of the column families that the sets read."""
    families = [columns.FLUX] if any(name.startswith("tl") for name in sets) else []
    families += [columns.INS_ATTITUDE] if "attitude" in sets else []
    return tuple(family.pattern for family in families)


def require(recording: Recording, names: Sequence[str]) -> None:
    """Refuse a recording that lacks one of the named columns.

    Raises
    ------
    RequestError
        Naming all that are missing.
    """
    missing = [name for name in names if name not in recording]
    if missing:
        msg = f"recording {recording.name!r} has no column {', '.join(missing)}"
        raise RequestError(msg)


@dataclass(frozen=True)
class Standardizer:
    """Shift and scale of columns, known from the training rows alone."""

    mean: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, matrices: Sequence[np.ndarray]) -> "Standardizer":
        """Mean and standard deviation over the rows of all matrices; a constant column keeps scale 1."""
        matrix = np.concatenate(matrices)
        scale = matrix.std(axis=0)
        size = np.abs(matrix).max(axis=0)
        return cls(matrix.mean(axis=0), np.where(scale > 1e-12 * size, scale, 1.0))

    def __call__(self, matrix: np.ndarray) -> np.ndarray:
        """Columns of about zero mean and unit deviation."""
        return (matrix - self.mean) / self.scale
