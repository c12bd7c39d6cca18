"""The pattern ``track``: a logged motion from a file, with a map of its columns and their units."""

import math
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from magsim.config import Strict
from magsim.units import FT

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "angle": {"deg": math.pi / 180.0, "rad": 1.0},
    "length": {"m": 1.0, "km": 1000.0, "ft": FT},
    "number": {"1": 1.0},
}
"""Units of each kind of quantity, with their factors to s, rad, m."""

KINDS = {
    "time": "time",
    "lat": "angle",
    "lon": "angle",
    "north": "length",
    "east": "length",
    "alt": "length",
    "roll": "angle",
    "pitch": "angle",
    "heading": "angle",
    "elevator": "angle",
    "aileron_left": "angle",
    "aileron_right": "angle",
    "rudder": "angle",
    "flap": "angle",
    "circuit": "number",
    "leg": "number",
    "turn": "number",
}
"""Quantities of a track and the kind of their unit."""

SURFACES = ("elevator", "aileron_left", "aileron_right", "rudder", "flap")
COUNTED = ("circuit", "leg", "turn")


class TrackColumn(Strict):
    """Where a quantity stands in the file."""

    name: str = Field(min_length=1, max_length=200, description="column of the CSV, data set of the HDF5 file")
    unit: str = Field(default="", description="without it s, deg, m, 1")


def _as_column(value: object) -> object:
    return {"name": value} if isinstance(value, str) else value


Named = Annotated[TrackColumn, BeforeValidator(_as_column)]


class TrackColumns(Strict):
    """Map of the columns; a name alone stands for seconds, degrees, meters."""

    time: Named = TrackColumn(name="time_s")
    lat: Named | None = None
    lon: Named | None = None
    north: Named | None = Field(default=None, description="from the start point, instead of lat and lon")
    east: Named | None = None
    alt: Named = TrackColumn(name="alt_m")
    roll: Named = TrackColumn(name="roll_deg")
    pitch: Named = TrackColumn(name="pitch_deg")
    heading: Named = Field(default=TrackColumn(name="heading_deg"), description="true, clockwise from north")
    elevator: Named | None = Field(default=None, description="surfaces: right-hand rule about the hinge axis")
    aileron_left: Named | None = None
    aileron_right: Named | None = None
    rudder: Named | None = None
    flap: Named | None = None
    circuit: Named | None = Field(default=None, description="whole numbers from 1; without it 1")
    leg: Named | None = Field(default=None, description="whole numbers from 1; without it the file is one leg")
    turn: Named | None = Field(default=None, description="1 in a turn, else 0")

    @field_validator(*KINDS)
    @classmethod
    def _known_unit(cls, value: TrackColumn | None, info: object) -> TrackColumn | None:
        units = UNITS[KINDS[info.field_name]]  # type: ignore[attr-defined]
        if value is not None and value.unit and value.unit not in units:
            msg = f"'{value.unit[:20]}' is no unit of it; allowed: {', '.join(units)}"
            raise ValueError(msg)
        return value

    @model_validator(mode="after")
    def _one_position(self) -> "TrackColumns":
        geographic, local = (self.lat, self.lon), (self.north, self.east)
        given = [all(pair) for pair in (geographic, local)]
        if sum(given) != 1 or any(any(pair) != all(pair) for pair in (geographic, local)):
            msg = "give either lat and lon, or north and east"
            raise ValueError(msg)
        return self

    def used(self) -> dict[str, tuple[str, float]]:
        """Return the column name and the factor to SI of every quantity that the file has."""
        out = {}
        for quantity, kind in KINDS.items():
            column = getattr(self, quantity)
            if column is not None:
                units = UNITS[kind]
                default = "deg" if kind == "angle" else next(iter(units))
                out[quantity] = (column.name, units[column.unit or default])
        return out


class TrackPattern(Strict):
    """The motion of a logged flight, flown through the field without a flight model."""

    kind: Literal["track"] = "track"
    file: str = Field(min_length=1, description="CSV with a header line, or HDF5 (.h5, .hdf5); beside the scenario")
    columns: TrackColumns
    delimiter: Literal[",", ";", "\t"] = Field(default=",", description="of a CSV file")
    heights: Literal["ellipsoid", "sea"] = Field(
        default="ellipsoid", description="what alt is above; 'sea' needs terrain.geoid_m"
    )
    from_s: float | None = Field(default=None, description="first time of the file that is used, as the file counts")
    to_s: float | None = Field(default=None, description="last time of the file that is used")
    max_gap_s: float = Field(default=1.0, gt=0.0, le=10.0, description="longest time between rows that is bridged")

    @property
    def maneuvers(self) -> tuple[()]:
        """A track has no maneuvers that anyone asked for."""
        return ()

    @property
    def circuits(self) -> int:
        """Largest circuit number that a track may have."""
        return 1000 if self.columns.circuit else 1

    @property
    def legs(self) -> int:
        """Largest leg number that a track may have."""
        return 10_000 if self.columns.leg else 1

    @field_validator("to_s")
    @classmethod
    def _later(cls, value: float | None, info: object) -> float | None:
        first = info.data.get("from_s")  # type: ignore[attr-defined]
        if value is not None and first is not None and value <= first:
            msg = f"{value:g} is not after from_s = {first:g}; allowed: above that"
            raise ValueError(msg)
        return value
