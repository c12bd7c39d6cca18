"""What a network reads: column sets by their names, fitted to the training rows, and their state for files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from magsim import columns
from magsim.compensation.background import Channel, live_channels
from magsim.compensation.background.channels import KINDS
from magsim.compensation.columns import (
    AngleColumns,
    AttitudeColumns,
    AttitudeRateColumns,
    AuxiliaryColumns,
    ChangeColumns,
    ChannelColumns,
    ColumnSet,
    CoupledColumns,
    Design,
    GyroColumns,
    HeightColumns,
    Joined,
    PlaceColumns,
    PointColumns,
    TimeColumns,
    TollesLawsonColumns,
    TravelColumns,
)
from magsim.compensation.columns.base import require
from magsim.compensation.columns.place import POSITION, middle_of
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.stage import takes_direction
from magsim.compensation.platform_columns import ColumnSettings, PlatformColumns, columns_from, fit_columns
from magsim.compensation.saving import State
from magsim.compensation.targets import reading_rows
from magsim.dataset import Training
from magsim.errors import RequestError
from magsim.recording import Recording

AUXILIARY = ("currents", "voltages", "surfaces")
"""Kinds of channels whose products with the direction are the input ``auxiliary``."""

DIRECTED = ("tl16", "tl18", "auxiliary")
"""Inputs that are made of the direction of the field."""

FREE: Mapping[str, ColumnSet] = {
    "attitude": AttitudeColumns(),
    "angles": AngleColumns(),
    "coupled": CoupledColumns(),
    "travel": TravelColumns(),
    "height": HeightColumns(),
    "time": TimeColumns(),
}
"""Inputs that need no fit."""


@dataclass(frozen=True)
class InputColumns:
    """Fitted inputs of a network; a ``ColumnSet``.

    Attributes
    ----------
    words : tuple of str
        Names of the inputs, in the order of their columns.
    platform : PlatformColumns, optional
        What those of the direction are made of.
    channels : mapping of str to tuple of Channel
        Those of each kind that change in the training.
    has_gyros : bool
        Whether the angular rates are those of the INS, else derivatives of its attitude.
    origin_deg : (float, float)
        Latitude and longitude that the position is counted from.
    left_out : tuple of str
        Channels that do not change in the training, and kinds without a channel.
    """

    words: tuple[str, ...]
    platform: PlatformColumns | None = None
    channels: Mapping[str, tuple[Channel, ...]] = field(default_factory=dict)
    has_gyros: bool = False
    origin_deg: tuple[float, float] = (0.0, 0.0)
    left_out: tuple[str, ...] = ()

    @cached_property
    def joined(self) -> Joined:
        """All column sets side by side."""
        sets = [self._set(word) for word in self.words]
        return Joined(tuple(one for one in sets if one is not None))

    def _set(self, word: str) -> ColumnSet | None:
        """Return the column set of an input; None of a kind without a channel."""
        if word in DIRECTED:
            assert self.platform is not None
            if word == "auxiliary":
                return self.platform.auxiliary
            return replace(self.platform.tolles_lawson, terms=18 if word == "tl18" else 16)
        if word in KINDS:
            return ChannelColumns(self.channels[word]) if self.channels[word] else None
        if word == "rates":
            return GyroColumns() if self.has_gyros else AttitudeRateColumns()
        return PlaceColumns(*self.origin_deg) if word == "position" else FREE[word]

    @property
    def reads(self) -> tuple[str, ...]:
        """Patterns of the column families that are read."""
        return self.joined.reads

    @property
    def lookahead_rows(self) -> int | None:
        """Rows after its own that the columns of a row need."""
        return self.joined.lookahead_rows

    @property
    def count(self) -> int:
        """Number of columns."""
        return sum(_count(one) for one in self.joined.sets)

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        return self.joined(recording)

    def state(self) -> State:
        """Return what a file needs beside the settings."""
        platform = None if self.platform is None else self.platform.state()
        values = {
            "platform": None if platform is None else dict(platform.values),
            "channels": {kind: [[c.name, c.rest] for c in found] for kind, found in self.channels.items()},
            "has_gyros": self.has_gyros,
            "origin_deg": list(self.origin_deg),
            "left_out": list(self.left_out),
        }
        return State(values, {} if platform is None else platform.arrays)


def _count(one: ColumnSet) -> int:
    if isinstance(one, TollesLawsonColumns):
        return one.terms
    if isinstance(one, AuxiliaryColumns):
        return 3 * len(one.channels)
    if isinstance(one, ChannelColumns):
        return len(one.channels)
    return len(one.names) if isinstance(one, PointColumns | ChangeColumns) else 1


def fit_inputs(settings: NetworkSettings, training: Training) -> InputColumns:
    """Fit the inputs of a network: direction, field strength, channels, origin of the position.

    Raises
    ------
    RequestError
        If there is no input left, a setting has no effect, or a recording lacks what is read.
    DataError
        If a value is not finite, or no background can be fitted.
    """
    _check(settings)
    recordings: Sequence[Recording] = reading_rows(training.recordings, training.sensor)
    platform: PlatformColumns | None = None
    left_out: tuple[str, ...] = ()
    if is_directed(settings):
        # a calibration filters, and leaves the rows without a reading out by itself
        uncut = training.recordings if settings.direction == "calibrated" else recordings
        platform = fit_columns(_platform_settings(settings), uncut, training.sensor)
        left_out = platform.left_out
    channels: dict[str, tuple[Channel, ...]] = {
        kind: live_channels(recordings, (kind,)) for kind in settings.inputs if kind in KINDS
    }
    for kind, found in channels.items():
        left_out += _left_out(kind, found, recordings)
    gyros = GyroColumns.columns
    made = InputColumns(
        settings.inputs,
        platform,
        channels,
        has_gyros="rates" in settings.inputs and all(name in r for r in recordings for name in gyros),
        origin_deg=_origin(recordings) if "position" in settings.inputs else (0.0, 0.0),
        left_out=tuple(dict.fromkeys(left_out)),
    )
    if not made.joined.sets:
        kinds = [kind for word in settings.inputs for kind in (AUXILIARY if word == "auxiliary" else (word,))]
        patterns = ", ".join(KINDS[kind].pattern for kind in dict.fromkeys(kinds))
        names = ", ".join(repr(recording.name) for recording in training.recordings)
        msg = (
            f"inputs {', '.join(settings.inputs)}: no column {patterns} changes in the training rows of {names}; "
            "allowed: inputs that the recordings have, such as tl16"
        )
        raise RequestError(msg)
    return made


def inputs_from(settings: NetworkSettings, state: State) -> InputColumns:
    """Make inputs of what their ``state`` returned; ``KeyError`` and ``ValueError`` mean that the file is broken."""
    values: Mapping[str, Any] = state.values
    platform = None
    if is_directed(settings):
        platform = columns_from(_platform_settings(settings), State(values["platform"], state.arrays))
    channels: dict[str, tuple[Channel, ...]] = {
        kind: tuple(
            Channel(str(name), None if rest is None else float(rest)) for name, rest in values["channels"][kind]
        )
        for kind in settings.inputs
        if kind in KINDS
    }
    lat, lon = values["origin_deg"]
    return InputColumns(
        settings.inputs,
        platform,
        channels,
        has_gyros=bool(values["has_gyros"]),
        origin_deg=(float(lat), float(lon)),
        left_out=tuple(map(str, values["left_out"])),
    )


def is_directed(settings: NetworkSettings) -> bool:
    """Whether an input is made of the direction of the field."""
    return any(word in DIRECTED for word in settings.inputs)


def sure_reads(settings: NetworkSettings) -> tuple[str, ...]:
    """Return the families that inputs read for sure, before the training tells which channels and gyros there are."""
    found: list[str] = []
    for word in settings.inputs:
        if word in DIRECTED:
            found += _platform_settings(settings).reads
        elif word in FREE:
            found += FREE[word].reads
        elif word == "position":
            found.append(columns.INS_ATTITUDE.pattern)
    return tuple(dict.fromkeys(found))


def most_lookahead(settings: NetworkSettings) -> int | None:
    """Return the rows after its own that a row needs, before the training: the most that it may need."""
    found = [FREE[word].lookahead_rows for word in settings.inputs if word in FREE]
    ahead = [rows for rows in found if rows is not None] + [int("rates" in settings.inputs)]
    if is_directed(settings):
        most = _platform_settings(settings).lookahead_rows
        if most is None:
            return None
        ahead.append(most)
    return max(ahead)


def _check(settings: NetworkSettings) -> None:
    """Refuse settings of the direction that nothing reads.

    Raises
    ------
    RequestError
    """
    if is_directed(settings) or takes_direction(settings):
        return
    what = f"inputs {', '.join(settings.inputs)} and first_stage {settings.first_stage!r}"
    if settings.direction != "fluxgate":
        msg = f"direction {settings.direction!r} has no effect with {what}; allowed: with inputs such as tl16"
        raise RequestError(msg)
    if settings.fluxgate is not None and settings.first_stage == "none":
        msg = f"fluxgate {settings.fluxgate!r} has no effect with {what}: it is not read"
        raise RequestError(msg)


def _platform_settings(settings: NetworkSettings) -> ColumnSettings:
    return ColumnSettings(
        18 if "tl18" in settings.inputs else 16,
        "central",
        "direction",
        settings.fluxgate,
        settings.scale == "sample",
        settings.direction,
        AUXILIARY if "auxiliary" in settings.inputs else (),
    )


def _origin(recordings: Sequence[Recording]) -> tuple[float, float]:
    for recording in recordings:
        require(recording, POSITION)
    return middle_of(recordings)


def _left_out(kind: str, found: Sequence[Channel], recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return the channels of a kind that do not change; that there is none, where there is none."""
    there = [name for name in recordings[0].data if KINDS[kind].match(name)]
    live = {channel.name for channel in found}
    return tuple(name for name in there if name not in live) if there else (f"no {kind}",)
