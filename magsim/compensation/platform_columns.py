"""The columns of the platform as settings name them: Tolles-Lawson terms of a direction, and auxiliary channels."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from magsim.columns import FLUX
from magsim.compensation.background import (
    LOOKAHEAD_ROWS,
    BackgroundField,
    Channel,
    Direction,
    background_from,
    fit_background,
    live_channels,
)
from magsim.compensation.background.channels import KINDS
from magsim.compensation.background.model import READS
from magsim.compensation.columns import (
    AuxiliaryColumns,
    Derivative,
    Design,
    Eddy,
    Joined,
    Terms,
    TollesLawsonColumns,
    mean_length,
    means_of,
    pick_fluxgate,
)
from magsim.compensation.columns.tolles_lawson import TERMS
from magsim.compensation.saving import State
from magsim.errors import RequestError
from magsim.recording import Recording

AHEAD_ROWS: dict[Direction, int] = {"fluxgate": 0, "ins": 0, "calibrated": LOOKAHEAD_ROWS}
"""Rows after its own that each direction needs."""


@dataclass(frozen=True)
class ColumnSettings:
    """Which columns a method has.

    Attributes
    ----------
    terms, derivative, eddy
        See ``TollesLawsonColumns``.
    fluxgate : str, optional
        The first one of the first recording if not given.
    by_sample : bool
        Whether the field strength in the columns is that of each row, else its mean over the training.
    direction : {"fluxgate", "ins", "calibrated"}
        See ``fit_background``.
    auxiliary : tuple of str
        Kinds of channels (``currents``, ``voltages``, ``surfaces``) and names of single ones.
    """

    terms: Terms
    derivative: Derivative
    eddy: Eddy
    fluxgate: str | None
    by_sample: bool
    direction: Direction
    auxiliary: tuple[str, ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """Families that are read for sure, before the training tells which channels there are."""
        return READS if self.direction == "ins" else (FLUX.pattern,)

    @property
    def lookahead_rows(self) -> int | None:
        """Rows after its own that a row needs, before a background is fitted: those that it will have."""
        ahead = AHEAD_ROWS[self.direction]
        if not TERMS[self.terms].eddy:
            return ahead
        return ahead + 1 if self.derivative == "central" else None

    def check(self) -> None:
        """Refuse settings without effect.

        Raises
        ------
        RequestError
        """
        if self.direction == "ins" and self.fluxgate is not None:
            msg = f"fluxgate {self.fluxgate!r} has no effect with direction 'ins': it is not read"
            raise RequestError(msg)
        if self.eddy == "field" and not TERMS[self.terms].eddy:
            msg = f"eddy 'field' has no effect with {self.terms} terms, which have no eddy currents; allowed: 16, 18"
            raise RequestError(msg)


@dataclass(frozen=True)
class PlatformColumns:
    """Fitted columns; a ``ColumnSet``.

    Attributes
    ----------
    tolles_lawson : TollesLawsonColumns
    background : BackgroundField, optional
        What the direction is of, unless it is the fluxgate as it is.
    auxiliary : AuxiliaryColumns, optional
    left_out : tuple of str
        Channels of the named kinds that do not change in the training, and kinds without a channel.
    """

    tolles_lawson: TollesLawsonColumns
    background: BackgroundField | None = None
    auxiliary: AuxiliaryColumns | None = None
    left_out: tuple[str, ...] = field(default=(), compare=False)

    @cached_property
    def joined(self) -> Joined:
        """All column sets side by side."""
        return Joined((self.tolles_lawson,) if self.auxiliary is None else (self.tolles_lawson, self.auxiliary))

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
        return self.tolles_lawson.terms + (0 if self.auxiliary is None else 3 * len(self.auxiliary.channels))

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        return self.joined(recording)

    def state(self) -> State:
        """Return what a file needs beside the settings."""
        made = self.tolles_lawson
        values: dict[str, object] = {
            "fluxgate": made.fluxgate,
            "strength_nt": made.strength_nt,
            "left_out": list(self.left_out),
            "background": None,
            "auxiliary": [],
        }
        arrays: dict[str, np.ndarray] = {}
        if self.background is not None:
            found = self.background.state()
            values["background"], arrays = dict(found.values), dict(found.arrays)
        if self.auxiliary is not None:
            pairs = zip(self.auxiliary.channels, self.auxiliary.means, strict=True)
            values["auxiliary"] = [[c.name, c.rest, mean] for c, mean in pairs if isinstance(c, Channel)]
        return State(values, arrays)


def fit_columns(settings: ColumnSettings, recordings: Sequence[Recording], sensor: str) -> PlatformColumns:
    """Fit the columns of the platform: fluxgate, background, field strength, channels.

    Parameters
    ----------
    settings : ColumnSettings
    recordings : sequence of Recording
        Training rows.
    sensor : str
        The scalar magnetometer.

    Raises
    ------
    RequestError
        If a setting has no effect, a named channel is missing or dead, or a recording lacks what is read.
    DataError
        If a value is not finite, or no background can be fitted.
    """
    settings.check()
    background, fluxgate = None, ""
    if settings.direction != "ins":
        fluxgate = pick_fluxgate(recordings, settings.fluxgate)
    if settings.direction != "fluxgate":
        background = fit_background(settings.direction, recordings, sensor, fluxgate=fluxgate or None)
    made = TollesLawsonColumns(settings.terms, fluxgate, settings.derivative, None, settings.eddy, background)
    if not settings.by_sample:
        vectors = [_vectors(made, recording) for recording in recordings]
        made = replace(made, strength_nt=mean_length(vectors))
    channels, left_out = _channels(settings.auxiliary, recordings)
    auxiliary = AuxiliaryColumns(channels, means_of(channels, recordings), made) if channels else None
    return PlatformColumns(made, background, auxiliary, left_out)


def columns_from(settings: ColumnSettings, state: State) -> PlatformColumns:
    """Make columns of what their ``state`` returned; ``KeyError`` and ``ValueError`` mean that the file is broken."""
    values = state.values
    background = None
    if values["background"] is not None:
        background = background_from(State(values["background"], state.arrays))
    strength_nt = values["strength_nt"]
    made = TollesLawsonColumns(
        settings.terms, values["fluxgate"], settings.derivative, strength_nt, settings.eddy, background
    )
    rows = values["auxiliary"]
    channels = tuple(Channel(str(name), None if rest is None else float(rest)) for name, rest, _ in rows)
    auxiliary = AuxiliaryColumns(channels, tuple(float(mean) for _, _, mean in rows), made) if rows else None
    return PlatformColumns(made, background, auxiliary, tuple(values["left_out"]))


def _vectors(made: TollesLawsonColumns, recording: Recording) -> np.ndarray:
    if made.field is not None:
        return made.field(recording)
    return recording.vector(FLUX, sensor=made.fluxgate)


def _channels(wanted: Sequence[str], recordings: Sequence[Recording]) -> tuple[tuple[Channel, ...], tuple[str, ...]]:
    """Return the channels that settings name, and what was left out of kinds.

    Raises
    ------
    RequestError
        If a named channel is missing or does not change.
    """
    live = {channel.name: channel for channel in live_channels(recordings, tuple(KINDS))}
    there = {kind: [n for n in recordings[0].data if family.match(n)] for kind, family in KINDS.items()}
    found: dict[str, Channel] = {}
    left_out = []
    for word in wanted:
        if word in KINDS:
            found |= {name: live[name] for name in there[word] if name in live}
            left_out += [name for name in there[word] if name not in live] or ([] if there[word] else [f"no {word}"])
        elif word in live:
            found[word] = live[word]
        else:
            raise RequestError(_refusal(word, there, recordings))
    return tuple(found.values()), tuple(left_out)


def _refusal(word: str, there: dict[str, list[str]], recordings: Sequence[Recording]) -> str:
    known = [name for names in there.values() for name in names]
    if word in known:
        return f"auxiliary {word!r} does not change in the training rows of every recording; leave it out"
    has = ", ".join(known) or "none"
    return (
        f"auxiliary {word!r} is no channel of recording {recordings[0].name!r}; allowed: {', '.join(KINDS)}, or of its "
        f"channels {has}"
    )
