"""Writing recordings for other programs: which format, which flights, which files."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from magsim import columns, storage
from magsim.errors import RequestError
from magsim.exchange import mit, tables
from magsim.recording import Recording
from magsim.recording.file import check_finite

Writer = Callable[[Path, Recording, int], None]


@dataclass(frozen=True)
class Format:
    """A format of files.

    Attributes
    ----------
    title : str
        For people.
    ending : str
        What follows the name of a flight in the name of its file.
    write : callable
        Writes one flight, given a path, a recording and the number of the flight.
    beside : mapping
        Writers of further files, by their ending.
    """

    title: str
    ending: str
    write: Writer
    beside: tuple[tuple[str, Writer], ...] = ()


def _unnumbered(write: Callable[[Path, Recording], None]) -> Writer:
    return lambda path, recording, _number: write(path, recording)


FORMATS: dict[str, Format] = {
    "mit": Format("HDF5 in the layout that MagNav.jl reads", "_mit.h5", mit.write),
    "xyz": Format("Geosoft XYZ", ".xyz", tables.write_xyz),
    "sgl-xyz": Format("XYZ as SGL writes it", "_sgl.xyz", tables.write_sgl),
    "gdf2": Format(
        "ASEG-GDF2, .dat and .dfn",
        ".dat",
        _unnumbered(tables.write_dat),
        ((".dfn", _unnumbered(tables.write_dfn)),),
    ),
    "csv": Format("CSV", ".csv", _unnumbered(tables.write_csv)),
    "parquet": Format("Parquet", ".parquet", _unnumbered(tables.write_parquet)),
}
"""Formats by the name that users give."""


def pick(recordings: Sequence[Recording], flight: str | None) -> list[tuple[int, Recording]]:
    """The flight that is asked for by its name or number, or all; each with its number.

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
    """The file of each flight.

    Parameters
    ----------
    flights : sequence of (number, Recording)
    kind : str
        One of ``FORMATS``.
    output : Path, optional
        A file for one flight, or a folder; by default the present folder, for one flight alone.

    Raises
    ------
    RequestError
        If several flights would meet in one file.
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
    """A file name that every system takes."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).lstrip(".")[:100] or "flight"


def export(
    flights: Sequence[tuple[int, Recording]],
    kind: str,
    output: Path | None = None,
    *,
    roles: Sequence[str] = columns.ROLES,
    force: bool = False,
) -> list[Path]:
    """Write flights for other programs, each file whole or not at all.

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
        What was written.

    Raises
    ------
    RequestError
        If a file is there already, cannot be written, or the format cannot tell a flight. All targets are looked at
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
    plan = []
    for path, (number, recording) in zip(paths, flights, strict=True):
        kept = {name: recording[name] for role in roles for name in recording.names(role)}
        part = replace(recording, data=kept)
        check_finite(part.name, part.time_s, part.data)
        steps = [(path, form.write), *((path.with_suffix(ending), write) for ending, write in form.beside)]
        plan += [(target, write, part, number) for target, write in steps]
    for target, *_ in plan:
        storage.check_target(target, force=force)
    for target, write, part, number in plan:
        storage.atomic_write(
            target, lambda path, write=write, part=part, number=number: write(path, part, number), force=force
        )
    return [target for target, *_ in plan]
