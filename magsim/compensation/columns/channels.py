"""Currents, voltages, deflections and accelerations as they are, one column for each channel."""

from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.columns.auxiliary import ChannelValues
from magsim.compensation.columns.base import Design, require
from magsim.recording import Recording


@dataclass(frozen=True)
class ChannelColumns:
    """Channels side by side.

    Attributes
    ----------
    channels : tuple of ChannelValues
        At least one.
    """

    channels: tuple[ChannelValues, ...]
    lookahead_rows: int = 0

    @property
    def reads(self) -> tuple[str, ...]:
        """Families of the channels."""
        return tuple(dict.fromkeys(columns.family_of(channel.name).pattern for channel in self.channels))

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        names = tuple(channel.name for channel in self.channels)
        require(recording, names)
        units = tuple(columns.family_of(name).unit for name in names)
        return Design(names, units, np.column_stack([channel(recording) for channel in self.channels]))
