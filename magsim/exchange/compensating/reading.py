"""Survey files as rows: what ``magsim import`` reads, and recordings."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.config import load
from magsim.errors import DataError, RequestError
from magsim.exchange import tables
from magsim.exchange.columnmap import ColumnMap, FieldMatch, match_fields
from magsim.exchange.compensating.survey import Survey
from magsim.exchange.importing import READERS, converted, kind_of, start_of
from magsim.recording import Recording

RECORDING = "recording"
"""Format of magsim's own files."""


@dataclass(frozen=True)
class SurveyFile:
    """A survey file that is read.

    Attributes
    ----------
    path : Path
    kind : str
        ``recording``, or one of ``SOURCES``.
    surveys : tuple of Survey
        One for each flight of a recording file, else one.
    recordings : tuple of Recording
        Of a recording file.
    """

    path: Path
    kind: str
    surveys: tuple[Survey, ...]
    recordings: tuple[Recording, ...] = ()


Keep = Callable[[Collection[str]], Collection[str]]
"""Given the columns that a file can give, returns those that are needed."""


def read_survey(path: Path, kind: str | None, mapping: ColumnMap, keep: Keep | None = None) -> SurveyFile:
    """Read a survey file.

    Parameters
    ----------
    path : Path
    kind : str, optional
        Format; by default according to the file.
    mapping : ColumnMap
    keep : callable, optional
        Tells which columns of a file of another program are needed; all by default.

    Raises
    ------
    RequestError
        If there is no such file, or the map does not fit it.
    DataError
        If it is broken, or a value is not possible.
    """
    if kind == RECORDING or (kind is None and is_recording(path)):
        if mapping != ColumnMap():
            msg = f"{path}: is a recording, whose columns have their names; --map is for files of other programs"
            raise RequestError(msg)
        from magsim.recording import read_recordings

        recordings = read_recordings(path)
        return SurveyFile(path, RECORDING, tuple(_of_recording(path, one) for one in recordings), recordings)
    kind = kind_of(path, kind)
    matches: list[FieldMatch] = []

    def choose(available: Sequence[str]) -> dict[str, str]:
        match = match_fields(available, mapping, layout=kind, where=str(path))
        matches.append(match if keep is None else restricted(match, keep(match.sources)))
        return matches[0].wanted()

    fields = READERS[kind](path, choose, mapping.nulls)
    match = matches[0]
    for name, values in fields.items():
        if np.isinf(values).any():
            msg = f"{path}: {name} is infinite in row {int(np.isinf(values).argmax()) + 1}"
            raise DataError(msg)
    data = {name: converted(str(path), name, source, fields[source.column]) for name, source in match.sources.items()}

    def start(row: int) -> str | None:
        found = start_of(str(path), {name: float(values[row]) for name, values in fields.items()}, match, mapping)
        return None if found is None else found.isoformat()

    line, flight = (fields[name] if name else None for name in (match.line, match.flight))
    survey = Survey(str(path), mapping.name or path.stem, fields[match.time], data, line, flight, start)
    return SurveyFile(path, kind, (survey,))


def read_map(path: Path | None) -> ColumnMap:
    """Return the map of a TOML file; an empty one without."""
    return ColumnMap() if path is None else load(path, ColumnMap)


def restricted(match: FieldMatch, wanted: Collection[str]) -> FieldMatch:
    """Return a match of wanted columns alone."""
    return replace(match, sources={name: source for name, source in match.sources.items() if name in wanted})


def is_recording(path: Path) -> bool:
    """Return whether an HDF5 file is a recording of magsim."""
    import h5py

    try:
        if path.suffix.lower() not in (".h5", ".hdf5") or not h5py.is_hdf5(path):
            return False
        with h5py.File(path, "r", locking=False) as file:
            return "flights" in file and "schema_version" in file.attrs
    except OSError:
        return False


def _of_recording(path: Path, recording: Recording) -> Survey:
    known = any(family.pattern in recording for family in (columns.CIRCUIT, columns.LEG))
    start = recording.meta.get("start_utc")
    return Survey(
        f"{path}: {recording.name}",
        recording.name,
        recording.time_s,
        recording.data,
        tables.line_numbers(recording) if known else None,
        None,
        lambda row: _later(start, float(recording.time_s[row])) if isinstance(start, str) else None,
    )


def _later(start: str, seconds: float) -> str:
    from datetime import datetime, timedelta

    return (datetime.fromisoformat(start) + timedelta(seconds=seconds)).isoformat()
