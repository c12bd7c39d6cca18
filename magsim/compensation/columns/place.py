"""Where and when: position, course over ground, height and time of day as network inputs.

What a network learns from them is not the aircraft: they fit networks whose part for the Earth's field is not
subtracted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from magsim import columns
from magsim.compensation.columns.base import Design
from magsim.compensation.columns.points import ChangeColumns, PointColumns, short_way
from magsim.errors import RequestError
from magsim.recording import Recording

POSITION = tuple(columns.INS_ATTITUDE.name(angle=angle) for angle in ("lat", "lon"))

_HOUR_S = 3600.0


@dataclass(frozen=True)
class PlaceColumns(PointColumns):
    """Latitude and longitude from an origin [deg], which keeps the date line away.

    Attributes
    ----------
    lat_deg, lon_deg : float
        The origin.
    """

    lat_deg: float
    lon_deg: float

    columns = POSITION
    names = ("lat", "lon")
    units = ("deg", "deg")

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the differences from the origin; see ``PointColumns``."""
        return np.column_stack([values[:, 0] - self.lat_deg, short_way(values[:, 1] - self.lon_deg)])


@dataclass(frozen=True)
class TravelColumns(ChangeColumns):
    """Changes of latitude and longitude [deg/s]."""

    columns = POSITION
    names = ("d lat", "d lon")
    units = ("deg/s", "deg/s")

    def of(self, values: np.ndarray, changes: np.ndarray) -> np.ndarray:
        """Return the changes; see ``ChangeColumns``."""
        return changes


@dataclass(frozen=True)
class HeightColumns(PointColumns):
    """Height of the INS above the ellipsoid [m]."""

    columns = (columns.INS_ALTITUDE.pattern,)
    names = ("height",)
    units = ("m",)

    def of(self, values: np.ndarray) -> np.ndarray:
        """Return the height; see ``PointColumns``."""
        return values


@dataclass(frozen=True)
class TimeColumns:
    """Time of day in UTC [h], which goes on after midnight."""

    reads: tuple[str, ...] = ()
    lookahead_rows: int = 0

    def __call__(self, recording: Recording) -> Design:
        """Return the column of a recording; see ``ColumnSet``."""
        start = recording.meta.get("start_utc")
        if start is None:
            msg = (
                f"recording {recording.name!r} does not say when it was flown, and the time of day is an input: import "
                "it with its date (start_utc)"
            )
            raise RequestError(msg)
        hours = hour_of(str(start)) + recording.time_s / _HOUR_S
        return Design(("time",), ("h",), hours[:, None])


def hour_of(start_utc: str) -> float:
    """Return the hour of the day of an instant."""
    start = datetime.fromisoformat(start_utc)
    midnight = start.replace(hour=0, minute=0, second=0, microsecond=0)
    return (start - midnight).total_seconds() / _HOUR_S


def middle_of(recordings: Sequence[Recording]) -> tuple[float, float]:
    """Return the mean latitude and longitude of recordings [deg]; on a sphere, so that the date line does no harm."""
    lat, lon = np.radians(np.concatenate([recording.stack(POSITION) for recording in recordings])).T
    x, y, z = (float(np.mean(v)) for v in (np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    return float(np.degrees(np.arctan2(z, np.hypot(x, y)))), float(np.degrees(np.arctan2(y, x)))
