"""Flights on disk, each prepared by itself: its own first stage and inputs, what the network reads and is to learn.

Flights are read one at a time, once each. Rows are kept in float32 relative to the first flight's scales, since those
of all flights are known at the end alone; windows are brought to the latter when they are read.
"""

import hashlib
import json
from collections.abc import Hashable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from torch import nn

from magsim.compensation.base import Compensator
from magsim.compensation.networks.fitted import Fitted, check_rate, left_by
from magsim.compensation.networks.inputs import InputColumns, fit_inputs
from magsim.compensation.networks.scaling import Moments
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import first_stage, tutor_of
from magsim.dataset import Training
from magsim.errors import DataError, MagsimError, RequestError
from magsim.recording import Recording
from magsim.signals import in_band, spans
from magsim.signals.filters import EDGE_S
from magsim.training import Spool

LEAST_NT = 1e-6
"""Smallest scale of a residual: below it there is nothing to learn."""


class Affine(NamedTuple):
    """What brings spooled columns to the scales of training: (value - shift) / scale, (c,) each."""

    shift: np.ndarray
    scale: np.ndarray

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Return columns in the scales of training, float32."""
        return (values - self.shift.astype(np.float32)) / self.scale.astype(np.float32)


@dataclass(frozen=True)
class SpooledFlight:
    """Where the rows of a flight are, and what is known of them.

    Attributes
    ----------
    group : hashable
        What it is held out by.
    pieces : tuple of (int, int)
        First row on disk and number of rows of each piece without a gap.
    in_band : Moments
        Of what the stage leaves, in band [nT].
    """

    group: Hashable
    pieces: tuple[tuple[int, int], ...]
    in_band: Moments


@dataclass(frozen=True)
class _Prepared:
    """A flight with its own inputs and stage."""

    columns: InputColumns
    stage: Compensator
    names: tuple[str, ...]
    matrix: np.ndarray
    left: np.ndarray
    reads: np.ndarray
    tutor: np.ndarray

    @classmethod
    def of(cls, settings: NetworkSettings, recording: Recording, sensor: str) -> "_Prepared":
        rows = Training.whole([recording], sensor)
        columns, stage = fit_inputs(settings, rows), first_stage(settings).fit_rows(rows)
        design, left = columns(recording), left_by(stage, settings, recording, sensor)
        tutor = np.zeros(len(recording))
        if settings.tutor > 0.0 and settings.first_stage == "none":
            tutor = tutor_of(settings, rows).interference(recording)
        return cls(columns, stage, design.names, design.matrix, left, recording.reads(sensor), tutor)

    @property
    def digest(self) -> str:
        """Of what inputs and stage were fitted to."""
        found = hashlib.sha256()
        for state in (self.columns.state(), self.stage.state()):
            found.update(json.dumps(state.values, sort_keys=True).encode())
            for name in sorted(state.arrays):
                found.update(name.encode() + np.ascontiguousarray(state.arrays[name]).tobytes())
        return found.hexdigest()


class SpooledFlights:
    """Flights on disk: a context manager, at whose end they are gone.

    Parameters
    ----------
    settings : NetworkSettings
    sensor : str
    folder : Path, optional
        Where on disk; the system's folder for temporary files if not given.

    Attributes
    ----------
    flights : list of SpooledFlight
    names : tuple of str
        Of the input columns.
    rate_hz : float [Hz]
    inputs, targets : Spool
        Columns that the network reads; what it is to learn, the tutor's estimate of that if there is one, and 1 in rows
        that are learned, 0 in others.
    """

    names: tuple[str, ...]
    rate_hz: float
    inputs: Spool

    def __init__(self, settings: NetworkSettings, sensor: str, folder: Path | None = None) -> None:
        self.settings, self.sensor, self.folder = settings, sensor, folder
        self.flights: list[SpooledFlight] = []
        self._open = ExitStack()
        self.targets = self._open.enter_context(Spool(2 + (settings.tutor > 0.0), folder))

    def __enter__(self) -> "SpooledFlights":
        return self

    def __exit__(self, *_error: object) -> None:
        self._open.close()

    def add(self, recording: Recording, group: Hashable) -> None:
        """Prepare a flight, which is held out by a group, and write it.

        Raises
        ------
        RequestError
            If its inputs are not those of the first, or the disk is full.
        DataError
            If it is too short, of another rate, or cannot be prepared; the message names it.
        """
        with _named(recording):
            self._check(recording)
            made = _Prepared.of(self.settings, recording, self.sensor)
        if not self.flights:
            self._begin(recording, made)
        elif made.names != self.names:
            raise RequestError(self._other_inputs(recording, made.names))
        self._same &= made.digest == self._digest
        base = self._base_of(made)
        left = made.left - base
        self._of_inputs += Moments.of(made.matrix)
        self._of_left += Moments.of(left[made.reads])
        self._of_mean += Moments.of(made.left[made.reads])
        first, in_the_band = len(self.targets), Moments.of(in_band(left, recording.time_s))
        self.inputs.append((made.matrix - self._scales.mean) / self._scales.scale)
        tutor = [made.tutor - base] if self.settings.tutor > 0.0 else []
        self.targets.append(np.column_stack([left, *tutor, made.reads]))
        pieces = tuple((first + span.start, span.stop - span.start) for span in spans(recording.time_s))
        self.flights.append(SpooledFlight(group, pieces, in_the_band))

    def fitted(self, module: nn.Module) -> Fitted:
        """Return scales over all flights, and the first flight's stage and inputs, beside a network."""
        mean, scale = float(self._of_mean.mean[0]), max(float(np.sqrt(self._of_left.variance[0])), LEAST_NT)
        return Fitted(
            self.settings,
            self._stage,
            self._columns,
            self.names,
            self._of_inputs.standardizer,
            mean,
            scale,
            module,
            self.rate_hz,
            is_start=not self._same,
        )

    def input_scales(self, fitted: Fitted) -> Affine:
        """Return what makes inputs of what is on disk."""
        to = fitted.standardizer
        return Affine((to.mean - self._scales.mean) / self._scales.scale, to.scale / self._scales.scale)

    def target_scales(self, fitted: Fitted) -> Affine:
        """Return what makes targets of what is on disk."""
        rest = self.targets.columns - 1
        mean = 0.0 if self._own_means else float(self._of_left.mean[0])
        return Affine(np.array([mean] * rest + [0.0]), np.array([fitted.scale] * rest + [1.0]))

    @property
    def _own_means(self) -> bool:
        """Whether the mean of what the stage leaves is that of each flight: an adaptation will have its own too."""
        return self.settings.first_stage != "none"

    def _base_of(self, made: _Prepared) -> float:
        """Return what is subtracted before rounding to float32 [nT]."""
        return float(made.left[made.reads].mean()) if self._own_means else self._base

    def _begin(self, recording: Recording, made: _Prepared) -> None:
        """Take names, rate and provisional scales from the first flight."""
        self.names, self.rate_hz, self._name = made.names, recording.rate_hz, recording.name
        self._stage, self._columns, self._digest, self._same = made.stage, made.columns, made.digest, True
        self._scales = Moments.of(made.matrix).standardizer
        self._base = float(made.left[made.reads].mean())
        none = np.zeros(0)
        self._of_inputs = Moments.of(np.zeros((0, len(made.names))))
        self._of_left = self._of_mean = Moments.of(none)
        self.inputs = self._open.enter_context(Spool(len(made.names), self.folder))

    def _check(self, recording: Recording) -> None:
        """Refuse a flight of another rate, or too short for a window or for the band-pass."""
        if self.flights:
            check_rate(recording, self.rate_hz)
        settings = self.settings
        judged = round(2.0 * EDGE_S * recording.rate_hz) + (settings.context or 1) + 1
        need, longest = max(settings.window, judged), max(span.stop - span.start for span in spans(recording.time_s))
        if longest < need:
            msg = (
                f"recording {recording.name!r} is too short: its longest piece without a gap has {longest} training "
                f"rows; allowed: {need} or more, for a window and for the band-pass"
            )
            raise DataError(msg)

    def _other_inputs(self, recording: Recording, names: Sequence[str]) -> str:
        more = [name for name in names if name not in self.names]
        less = [name for name in self.names if name not in names]
        words = [f"{word} {', '.join(found)}" for word, found in (("has", more), ("lacks", less)) if found]
        return (
            f"recording {recording.name!r} has other inputs than {self._name!r}: it {' and '.join(words)}; "
            "allowed: flights with the same inputs, or other inputs"
        )


@contextmanager
def _named(recording: Recording) -> Iterator[None]:
    """Have errors name a recording: one of thousands."""
    try:
        yield
    except MagsimError as error:
        if repr(recording.name) in str(error):
            raise
        msg = f"recording {recording.name!r}: {error}"
        raise type(error)(msg) from None
