"""Where a method takes the direction of the field from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from magsim import columns
from magsim.compensation.background.calibrated import CalibratedField, Regressors, fluxgate_reading
from magsim.compensation.background.calibration import calibrate
from magsim.compensation.background.channels import Channel, live_channels
from magsim.compensation.background.model import ModelField
from magsim.compensation.background.rows import VectorRows
from magsim.compensation.columns.direction import pick_fluxgate
from magsim.compensation.saving import State
from magsim.compensation.streaming import Feed, FluxgateRows
from magsim.recording import Recording

Direction = Literal["fluxgate", "ins", "calibrated"]

LOOKAHEAD_ROWS = 8
"""Rows that the filters of a calibrated fluxgate look ahead by default; more bring nothing."""

FLUXGATE_SEES = ("currents", "surfaces")
"""Kinds of channels whose field at the fluxgate is calibrated."""


class BackgroundField(Protocol):
    """Makes the background of a recording from its inputs."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""

    @property
    def lookahead_rows(self) -> int:
        """Rows after its own that a row needs."""

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the background, (n, 3) [nT], in body axes, or in those of the fluxgate that is taken as it is."""

    def rows(self, feed: Feed) -> VectorRows:
        """Return the background row by row."""

    def state(self) -> State:
        """Return what a file needs."""


@dataclass(frozen=True)
class FluxgateField:
    """The fluxgate's reading as it is, in its own axes."""

    fluxgate: str
    lookahead_rows: int = 0

    @property
    def reads(self) -> tuple[str, ...]:
        """The fluxgate."""
        return (columns.FLUX.pattern,)

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the reading, (n, 3) [nT]."""
        return fluxgate_reading(recording, self.fluxgate)

    def rows(self, feed: Feed) -> FluxgateRows:
        """Return the reading row by row."""
        return FluxgateRows(self.fluxgate)

    def state(self) -> State:
        """Return what a file needs."""
        return State({"direction": "fluxgate", "fluxgate": self.fluxgate})


def fit_background(
    direction: Direction,
    recordings: Sequence[Recording],
    sensor: str,
    *,
    fluxgate: str | None = None,
    lookahead_rows: int = LOOKAHEAD_ROWS,
    labels: bool = True,
    channels: tuple[Channel, ...] | None = None,
) -> BackgroundField:
    """Return the background by its name, fitted where it must be.

    Parameters
    ----------
    direction : {"fluxgate", "ins", "calibrated"}
        The reading of a fluxgate; the model field by the INS; or a fluxgate that was calibrated against that, with what
        currents and control surfaces do to it, its lag and its bandwidth.
    recordings : sequence of Recording
        Training rows.
    sensor : str
        The scalar magnetometer.
    fluxgate : str, optional
        The first one of the first recording if not given.
    lookahead_rows : int
    labels : bool
        Let labels tell the length of the background, where there are any.
    channels : tuple of Channel, optional
        What ``live_channels`` gives for ``FLUXGATE_SEES``, where it is at hand.

    Raises
    ------
    RequestError
        If a recording lacks a column or its date.
    DataError
        If a value is not finite, rows are too few, or INS, date and fluxgate do not go together.
    """
    if direction == "ins":
        return ModelField()
    fluxgate = pick_fluxgate(recordings, fluxgate)
    if direction == "fluxgate":
        return FluxgateField(fluxgate)
    channels = live_channels(recordings, FLUXGATE_SEES) if channels is None else channels
    regressors = Regressors(fluxgate, channels, lookahead_rows)
    lengths = [_labeled_length(recording, sensor) if labels else None for recording in recordings]
    masks = [
        np.ones(len(recording), dtype=bool) if length is None else recording.reads(sensor)
        for recording, length in zip(recordings, lengths, strict=True)
    ]
    return calibrate(recordings, regressors, lengths, masks)


def background_from(state: State) -> BackgroundField:
    """Make a background of what its ``state`` returned; a ``KeyError`` or ``ValueError`` means that it is broken."""
    direction = state.values["direction"]
    if direction == "ins":
        return ModelField()
    if direction == "fluxgate":
        return FluxgateField(str(state.values["fluxgate"]))
    if direction == "calibrated":
        return CalibratedField.of(state)
    msg = f"direction {direction!r}"
    raise ValueError(msg)


def _labeled_length(recording: Recording, sensor: str) -> np.ndarray | None:
    """Return the length of the background by reading and label, (n,) [nT]; None without a label."""
    label = columns.INTERFERENCE.name(sensor=sensor)
    if label not in recording:
        return None
    return recording[columns.MAG.name(sensor=sensor)] - recording[label]
