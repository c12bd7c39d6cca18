"""Auxiliary columns: what a current, a voltage or a control surface adds, as channel times direction cosine.

A wire that carries a current, or a magnet that turns with a surface, makes a vector in body axes in proportion to the
channel; the scalar sensor sees its component along the field.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design
from magsim.compensation.columns.tolles_lawson import TollesLawsonColumns
from magsim.recording import Recording

GROUPS = {
    columns.CURRENT: "current",
    columns.VOLTAGE: "voltage",
    columns.SURFACE: "surface",
    columns.INS_ACCELERATION: "acceleration",
}
"""Families of channels, with the word for each."""


class ChannelValues(Protocol):
    """One channel of a recording."""

    @property
    def name(self) -> str:
        """Column of the recording."""

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the channel, (n,)."""


@dataclass(frozen=True)
class AuxiliaryColumns:
    """Channels times direction cosines, three columns for each channel.

    Attributes
    ----------
    channels : tuple of ChannelValues
        Currents, voltages and deflections.
    means : tuple of float
        What is taken from each channel: its mean over the training, so that its columns are not the permanent ones.
    source : TollesLawsonColumns
        Gives the direction cosines.
    """

    channels: tuple[ChannelValues, ...]
    means: tuple[float, ...]
    source: TollesLawsonColumns

    @property
    def reads(self) -> tuple[str, ...]:
        """Families of the channels, and what the direction is made of."""
        families = (columns.family_of(channel.name).pattern for channel in self.channels)
        return tuple(dict.fromkeys([*self.source.reads, *families]))

    @property
    def lookahead_rows(self) -> int:
        """That of the direction."""
        return 0 if self.source.field is None else self.source.field.lookahead_rows

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        cosines, _ = self.source.vectors(recording)
        names, units, groups, parts = [], [], [], []
        for channel, mean in zip(self.channels, self.means, strict=True):
            family = columns.family_of(channel.name)
            (mark,) = (family.match(channel.name) or {}).values()
            names += [f"{channel.name} u{i + 1}" for i in range(3)]
            units += [f"nT/({family.unit})" if "/" in family.unit else f"nT/{family.unit}"] * 3
            groups += [f"{GROUPS[family]} {mark}"] * 3
            parts.append((channel(recording) - mean)[:, None] * cosines)
        return Design(tuple(names), tuple(units), np.hstack(parts), tuple(groups))


def means_of(channels: Sequence[ChannelValues], recordings: Sequence[Recording]) -> tuple[float, ...]:
    """Return the mean of each channel over recordings."""
    return tuple(float(np.concatenate([channel(r) for r in recordings]).mean()) for channel in channels)
