"""Export of recordings for other programs: formats, flights, files."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

from magsim import columns, storage
from magsim.errors import RequestError
from magsim.exchange import mit, tables
from magsim.recording import Recording
from magsim.recording.file import check_finite


class Writer(Protocol):
    """Writes one flight to a file that may be overwritten."""

    def __call__(self, path: Path, /, recording: Recording, flight: int) -> None:
        """Write a recording with the number of its flight."""


@dataclass(frozen=True)
class ExportFormat:
    """A file format.

    Attributes
    ----------
    title : str
        For people.
    ending : str
        Appended to the name of a flight to make the name of its file.
    write : callable
        Writes one flight; called with a path, a recording and the number of the flight.
    companions : tuple of (str, callable)
        Endings and writers of further files.
    """

    title: str
    ending: str
    write: Writer
    companions: tuple[tuple[str, Writer], ...] = ()


def _unnumbered(write: Callable[[Path, Recording], None]) -> Writer:
    def numbered(path: Path, /, recording: Recording, flight: int) -> None:
        write(path, recording)

    return numbered


FORMATS: dict[str, ExportFormat] = {
    "mit": ExportFormat("HDF5 in the layout that MagNav.jl reads", "_mit.h5", mit.write),
    "xyz": ExportFormat("Geosoft XYZ", ".xyz", tables.write_xyz),
    "sgl-xyz": ExportFormat("XYZ as SGL writes it", "_sgl.xyz", tables.write_sgl),
    "gdf2": ExportFormat(
        "ASEG-GDF2, .dat and .dfn",
        ".dat",
        _unnumbered(tables.write_dat),
        ((".dfn", _unnumbered(tables.write_dfn)),),
    ),
    "csv": ExportFormat("CSV", ".csv", _unnumbered(tables.write_csv)),
    "parquet": ExportFormat("Parquet", ".parquet", _unnumbered(tables.write_parquet)),
}
"""Formats by the names that users give."""


def pick(recordings: Sequence[Recording], flight: str | None) -> list[tuple[int, Recording]]:
    """Return the flight with a name or number, or all flights; each with its number.

    Raises
    ------
    RequestError
        If there is no such flight, or several have that name.
    """
    numbered = list(enumerate(recordings, start=1))
    if flight is None:
        return numbered
    found = [(number, r) for number, r in numbered if r.name == flight]
    if not found and flight.isascii() and flight.isdigit():
        found = [(number, r) for number, r in numbered if str(number) == flight]
    if len(found) == 1:
        return found
    has = ", ".join(f"{number} {r.name}" for number, r in numbered[:20])
    msg = f"there is no flight {flight!r}; allowed: {has}"
    if found:
        msg = f"{len(found)} flights have the name {flight!r}; give a number: {has}"
    raise RequestError(msg)


def targets(flights: Sequence[tuple[int, Recording]], kind: str, output: Path | None) -> list[Path]:
    """Return the file of each flight.

    Parameters
    ----------
    flights : sequence of (number, Recording)
    kind : str
        One of ``FORMATS``.
    output : Path, optional
        A file for one flight, or a folder; by default the working folder, for a single flight only.

    Raises
    ------
    RequestError
        If several flights would be written to one file.
    """
    ending = FORMATS[kind].ending
    folder = output is not None and output.is_dir()
    if len(flights) > 1 and not folder:
        names = ", ".join(f"{number} {r.name}" for number, r in flights[:20])
        msg = (
            f"there are {len(flights)} flights ({names}), and one file holds one: pick one with --flight, "
            "or give an existing folder with -o for all"
        )
        raise RequestError(msg)
    if output is not None and not folder:
        if kind == "gdf2" and output.suffix != ".dat":
            msg = f"{output}: the format gdf2 writes a pair of files; give the name of the one that ends in .dat"
            raise RequestError(msg)
        return [output]
    stems = [stem(recording.name) for _, recording in flights]
    out = []
    for (number, _), name in zip(flights, stems, strict=True):
        unique = name if [s.lower() for s in stems].count(name.lower()) == 1 else f"{name}_{number}"
        out.append((output or Path()) / f"{unique}{ending}")
    return out


def stem(name: str) -> str:
    """Return a file name that is valid on every system."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).lstrip(".")[:100] or "flight"


def export(
    flights: Sequence[tuple[int, Recording]],
    kind: str,
    output: Path | None = None,
    *,
    roles: Sequence[str] = columns.ROLES,
    force: bool = False,
) -> list[Path]:
    """Write flights for other programs, each file completely or not at all.

    Parameters
    ----------
    flights : sequence of (number, Recording)
        From ``pick``.
    kind : str
        One of ``FORMATS``.
    output : Path, optional
        See ``targets``.
    roles : sequence of str
        Roles of the columns that are written.
    force : bool
        Replace existing files.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    RequestError
        If a file exists already or cannot be written, or the format cannot represent a flight. All targets are checked
        before the first is written.
    DataError
        If a column is not finite.
    """
    unknown = [role for role in roles if role not in columns.ROLES]
    if unknown or not roles:
        msg = f"{', '.join(unknown) or 'no role'} is not allowed for roles; allowed: {', '.join(columns.ROLES)}"
        raise RequestError(msg)
    form = FORMATS[kind]
    paths = targets(flights, kind, output)
    if len(set(paths)) < len(paths):
        msg = f"two flights would be written to {max(paths, key=paths.count)}"
        raise RequestError(msg)
    writes: list[tuple[Path, Writer, Recording, int]] = []
    for path, (number, recording) in zip(paths, flights, strict=True):
        kept = {name: recording[name] for role in roles for name in recording.names(role)}
        part = replace(recording, data=kept)
        check_finite(part.name, part.time_s, part.data)
        steps = [(path, form.write), *((path.with_suffix(ending), write) for ending, write in form.companions)]
        writes += [(target, write, part, number) for target, write in steps]
    for target, *_ in writes:
        storage.check_target(target, force=force)
    for target, write, part, number in writes:
        storage.atomic_write(target, partial(write, recording=part, flight=number), force=force)
    return [target for target, *_ in writes]
