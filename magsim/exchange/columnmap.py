"""Correspondence of the fields of a foreign file and the columns of a recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field

from magsim import columns
from magsim.config import Strict
from magsim.errors import RequestError
from magsim.exchange import sgl
from magsim.exchange.textfile import LINE_FIELD

ROLES = ("input", "segment")
"""Roles that a foreign file may fill: truth is known to a simulator only."""


class FieldSource(Strict):
    """Field of a foreign file that a column is computed from: ``column * scale + offset``."""

    column: Annotated[str, Field(min_length=1, max_length=200)]
    scale: Annotated[float, Field(ge=-1e12, le=1e12)] = 1.0
    offset: Annotated[float, Field(ge=-1e12, le=1e12)] = 0.0


def _plain(value: object) -> object:
    return {"column": value} if isinstance(value, str) else value


class ColumnMap(Strict):
    """A map file: names of a foreign file for columns of a recording, and the numbers that stand for missing values."""

    name: Annotated[str, Field(min_length=1, max_length=100)] | None = None
    start_utc: datetime | None = None
    time: str | None = None
    line: str | None = None
    flight: str | None = None
    nulls: tuple[float, ...] = ()
    columns: dict[str, Annotated[FieldSource, BeforeValidator(_plain)]] = Field(default_factory=dict)


@dataclass(frozen=True)
class FieldMatch:
    """Fields that are read from a file, by their names there.

    Attributes
    ----------
    time : str
    line, flight, year, doy : str
        Empty if there is none.
    sources : mapping
        Column of the recording to its source.
    unused : tuple of str
        Fields of a file without a fixed layout that no column is computed from.
    """

    time: str
    line: str
    flight: str
    year: str
    doy: str
    sources: Mapping[str, FieldSource]
    unused: tuple[str, ...] = ()

    def wanted(self) -> dict[str, str]:
        """Return the names of the fields that must be read."""
        service = (self.time, self.line, self.flight, self.year, self.doy)
        return {name: name for name in (*service, *(s.column for s in self.sources.values())) if name}


def match_fields(available: Sequence[str], mapping: ColumnMap, *, layout: str, where: str) -> FieldMatch:
    """Match the fields of a file with columns.

    Parameters
    ----------
    available : sequence of str
        Names of the fields in the file.
    mapping : ColumnMap
        The user's map; takes precedence over the layout.
    layout : str
        ``mit`` (SGL's field names), ``sgl-xyz`` (SGL's column heads), or another: fields named as columns.
    where : str
        File, for messages.

    Raises
    ------
    RequestError
        If the map names a field that the file lacks, or a column that is no input or segment.
    """
    # heads of SGL's text files and names of its HDF5 fields mean the same
    alias = {field.head: field.name for field in sgl.FIELDS} if layout == "sgl-xyz" else {}
    own = {alias.get(name, name): name for name in reversed(available)}

    def find(name: str, key: str) -> str:
        if name in available:
            return name
        if name in own:
            return own[name]
        msg = f"{where}: there is no column {name!r}, which {key} of the map names; it has {', '.join(available[:40])}"
        raise RequestError(msg)

    for name in mapping.columns:
        family = columns.find(name)
        if family is None or family.role not in ROLES:
            what = "is no column" if family is None else f"is {family.role}, which no foreign file may have"
            msg = f"columns.{name} of the map: {name} {what}; allowed: inputs and segments of docs/recording.md"
            raise RequestError(msg)
    given = {
        name: source.model_copy(update={"column": find(source.column, f"columns.{name}")})
        for name, source in mapping.columns.items()
    }
    if layout in ("mit", "sgl-xyz"):
        found = {name: own[theirs] for theirs, name in (("tt", "time"), *_SERVICE) if theirs in own}
        default = _of_layout(own)
    else:
        found = {"time": columns.TIME, "line": LINE_FIELD if LINE_FIELD in available else ""}
        default = {name: FieldSource(column=name) for name in available if _is_known(name)}
    taken = {source.column for source in given.values()}
    default = {name: s for name, s in default.items() if name not in given and s.column not in taken}
    for key in ("time", "line", "flight"):
        asked = getattr(mapping, key)
        if asked is not None:
            found[key] = find(asked, key)
    if found.get("time") not in available:
        msg = f"{where}: has no time ({columns.TIME} or tt); the key time of a map names it; it has "
        msg += ", ".join(available[:40])
        raise RequestError(msg)
    time, line, flight, year, doy = (found.get(key, "") for key in ("time", "line", "flight", "year", "doy"))
    match = FieldMatch(time, line, flight, year, doy, given | default)
    free = () if layout in ("mit", "sgl-xyz") else available
    return replace(match, unused=tuple(name for name in free if name not in match.wanted()))


_SERVICE = (("line", "line"), ("flight", "flight"), ("year", "year"), ("doy", "doy"))


def _is_known(name: str) -> bool:
    family = columns.find(name)
    return family is not None and family.role in ROLES


def _of_layout(own: Mapping[str, str]) -> dict[str, FieldSource]:
    """Return the columns that correspond to fields of the SGL layout."""
    out = {}
    for number in sgl.MAGNETOMETERS:
        out[columns.MAG.name(sensor=f"m{number}")] = (f"mag_{number}_uc", 1.0)
    for letter in sgl.FLUXGATES:
        for axis in columns.AXES:
            out[columns.FLUX.name(sensor=letter, axis=axis)] = (f"flux_{letter}_{axis}", 1.0)
    out |= {ours: (theirs, 1.0) for theirs, ours in sgl.DIRECT.items()}
    out |= {ours: (theirs, -1.0) for theirs, ours in sgl.NEGATED.items()}
    out |= {ours: (theirs, 1.0 / factor) for theirs, (ours, factor) in sgl.SCALED.items()}
    for angle in ("lat", "lon"):
        in_radians = f"ins_{angle}" in own
        out[f"ins_{angle}_deg"] = (f"ins_{angle}", float(np.degrees(1.0))) if in_radians else (angle, 1.0)
    if "ins_alt" not in own:
        out[columns.INS_ALTITUDE.pattern] = ("utm_z", 1.0)
    out[columns.RADAR.pattern] = ("radar", 1.0)
    return {ours: FieldSource(column=own[theirs], scale=k) for ours, (theirs, k) in out.items() if theirs in own}
