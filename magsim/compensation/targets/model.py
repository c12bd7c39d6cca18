"""Targets that take a known clean field from the reading: the model of the main field, and a map of the anomalies."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from magsim import columns
from magsim.compensation.targets.anomaly_map import AnomalyMap
from magsim.compensation.targets.base import finite, reading
from magsim.compensation.targets.pairs import Pairs
from magsim.earth import decimal_years, igrf
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

POSITION = (
    columns.INS_ATTITUDE.name(angle="lat"),
    columns.INS_ATTITUDE.name(angle="lon"),
    columns.INS_ALTITUDE.pattern,
)


def position(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return latitude and longitude [deg] and height above the ellipsoid [m] from the INS, (n,) each.

    Raises
    ------
    DataError
        If a value is not finite.
    """
    lat, lon, alt = (finite(recording, name, name) for name in POSITION)
    return lat, lon, alt


def model_strength(recording: Recording) -> np.ndarray:
    """Return the length of IGRF-14 at the position and the time of each row, (n,) [nT].

    Raises
    ------
    RequestError
        If the recording does not tell its start in UTC.
    DataError
        If a position is not finite or no latitude, or a year is outside of the model.
    """
    start = recording.meta.get("start_utc")
    if not isinstance(start, str):
        msg = (
            f"recording {recording.name!r} has no start_utc, which the model of the main field needs; magsim import "
            "takes it from a column map (start_utc)"
        )
        raise RequestError(msg)
    lat, lon, alt = position(recording)
    years = decimal_years(datetime.fromisoformat(start), recording.time_s)
    try:
        field_n = igrf(np.radians(lat), np.radians(lon), alt, years)
    except ValueError as error:
        msg = f"recording {recording.name!r}: {error}"
        raise DataError(msg) from None
    return np.sqrt(np.einsum("ni,ni->n", field_n, field_n))


@dataclass(frozen=True)
class KnownField:
    """The reading minus the length of the model field at the INS position: what crust and time variation add is left.

    Attributes
    ----------
    anomalies : AnomalyMap, optional
        Taken from the reading too: target ``map``.
    """

    anomalies: AnomalyMap | None = None
    measured: bool = True
    broadband: bool = True

    @property
    def name(self) -> str:
        """``model`` or ``map``."""
        return "model" if self.anomalies is None else "map"

    def reads(self, sensor: str) -> tuple[str, ...]:
        """Return the columns of the reading and of the position."""
        return (columns.MAG.name(sensor=sensor), *POSITION)

    def values(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the reading without the known field, (n,) [nT]; see ``Target``."""
        left = reading(recording, sensor) - model_strength(recording)
        return left if self.anomalies is None else left - self.anomalies.at(*position(recording), recording.name)

    def known(self, recording: Recording, sensor: str) -> np.ndarray:
        """Return the rows in which the magnetometer reads."""
        return recording.reads(sensor)

    def pairs(self, recordings: Sequence[Recording], sensor: str) -> Pairs | None:
        """Return None."""
        return None
