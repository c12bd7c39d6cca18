"""Attitude as network inputs."""

from dataclasses import dataclass

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design, require
from magsim.recording import Recording

ANGLES = ("roll", "pitch", "heading")


@dataclass(frozen=True)
class AttitudeColumns:
    """Roll and pitch [rad], sine and cosine of the heading: an angle that wraps would jump."""

    lookahead_rows = 0

    @property
    def reads(self) -> tuple[str, ...]:
        """The attitude of the INS."""
        return (columns.INS_ATTITUDE.pattern,)

    def __call__(self, recording: Recording) -> Design:
        """Return the columns of a recording; see ``ColumnSet``."""
        names = [columns.INS_ATTITUDE.name(angle=angle) for angle in ANGLES]
        require(recording, names)
        roll, pitch, heading = (np.radians(recording[name]) for name in names)
        matrix = np.column_stack([roll, pitch, np.sin(heading), np.cos(heading)])
        return Design(("roll", "pitch", "sin heading", "cos heading"), ("rad", "rad", "1", "1"), matrix)
