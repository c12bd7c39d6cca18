"""The model field in body axes: IGRF-14 at the position of the INS, turned by its attitude. Inputs alone."""

from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import numpy as np

from magsim import columns
from magsim.compensation.background.rows import ModelRows
from magsim.compensation.columns.base import require
from magsim.compensation.saving import State
from magsim.compensation.streaming.protocol import Feed
from magsim.earth import decimal_years, igrf
from magsim.errors import DataError, RequestError
from magsim.frames import rot_nb_from_attitude, rotate_back
from magsim.recording import Recording

READS = (columns.INS_ATTITUDE.pattern, columns.INS_ALTITUDE.pattern)
"""Families that are read: attitude and position of the INS."""

_NAMES = (*(columns.INS_ATTITUDE.name(angle=angle) for angle in columns.INS_ANGLES), columns.INS_ALTITUDE.pattern)


class Aligned(NamedTuple):
    """The model field along a flight.

    Attributes
    ----------
    rot_nb : (n, 3, 3)
        From body to north-east-down axes, by the attitude of the INS.
    field_n : (n, 3) [nT]
        Model field, north, east, down.
    """

    rot_nb: np.ndarray
    field_n: np.ndarray

    @property
    def field_b(self) -> np.ndarray:
        """Model field in body axes, (n, 3) [nT]."""
        return rotate_back(self.rot_nb, self.field_n)


def model_along(recording: Recording, rows: slice = slice(None)) -> Aligned:
    """Return the model field along a recording, or in some of its rows.

    Raises
    ------
    RequestError
        If the recording lacks attitude or position of the INS, or does not say when it was flown.
    DataError
        If a value is not finite.
    """
    require(recording, _NAMES)
    start = recording.meta.get("start_utc")
    if start is None:
        msg = (
            f"recording {recording.name!r} does not say when it was flown, and the model field changes by up to 100 nT "
            "a year: import it with its date (start_utc)"
        )
        raise RequestError(msg)
    values = recording.stack(_NAMES)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        msg = f"recording {recording.name!r}: {_NAMES[column]} is not finite at {recording.time_s[row]:g} s"
        raise DataError(msg)
    roll, pitch, heading, lat, lon = np.radians(values[rows, :5]).T
    years = decimal_years(datetime.fromisoformat(str(start)), recording.time_s[rows])
    attitude = np.column_stack([roll, pitch, heading])
    return Aligned(rot_nb_from_attitude(attitude), igrf(lat, lon, values[rows, 5], years))


@dataclass(frozen=True)
class ModelField:
    """The background by the INS and the model of the main field alone ("modified Tolles-Lawson")."""

    lookahead_rows: int = 0

    @property
    def reads(self) -> tuple[str, ...]:
        """Attitude and position of the INS."""
        return READS

    def __call__(self, recording: Recording) -> np.ndarray:
        """Return the model field in body axes, (n, 3) [nT]; see ``model_along`` for what is raised."""
        return model_along(recording).field_b

    def rows(self, feed: Feed) -> ModelRows:
        """Return the model field row by row; see ``ModelRows`` for what is raised."""
        return ModelRows(feed)

    def state(self) -> State:
        """Return what a file needs."""
        return State({"direction": "ins"})
