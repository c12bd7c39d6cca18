"""Which recordings belong together: a method is fitted on a group's training rows and judged on its test rows."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

from magsim.dataset import parquet
from magsim.dataset.folder import Dataset
from magsim.dataset.index import FlightInfo, index_file, recording_files
from magsim.dataset.manifest import MANIFEST, FileEntry, read_manifest
from magsim.errors import MagsimError, RequestError
from magsim.recording import Recording
from magsim.storage import inspection

Data = Recording | Dataset | Path | str | Iterable["Recording | Dataset | Path | str"]
"""What is fitted or judged: a recording, a data set, a recording file, a folder of them, or several of these."""

EVERYTHING = "all"
"""Name of the group of everything that was given."""


@dataclass(frozen=True)
class Group:
    """Flights that belong together.

    Attributes
    ----------
    name : str
    flights : tuple of FlightInfo
    """

    name: str
    flights: tuple[FlightInfo, ...]


def flights_of(data: Data) -> tuple[FlightInfo, ...]:
    """List the flights of whatever was given, without reading their values.

    Parameters
    ----------
    data : Recording, Dataset, Path, str, or several of them

    Raises
    ------
    RequestError
        If it is something else, or there is no such file or folder.
    DataError
        If a file is no recording or is damaged, or a manifest is broken.
    """
    return tuple(_flights(data))


def _flights(data: Data) -> Iterator[FlightInfo]:
    if isinstance(data, Recording):
        yield FlightInfo.of(data)
    elif isinstance(data, Dataset):
        yield from _of_folder(data.folder, data.files)
    elif isinstance(data, Path | str):
        path = Path(data)
        if path.is_dir():
            yield from _of_folder(path, recording_files(path))
        else:
            yield from _of_files([path], _listed_beside(path))
    elif isinstance(data, Iterable):
        for item in data:
            yield from _flights(item)
    else:
        msg = (
            f"{type(data).__name__} holds no recordings; allowed: a Recording, a Dataset, the path of a recording file "
            "or of a folder of them, or a list of these"
        )
        raise RequestError(msg)


def _listed(folder: Path) -> dict[str, FileEntry]:
    """Return what the manifest of a folder states of its files, by name; nothing without a manifest."""
    manifest = folder / MANIFEST
    return {entry.name: entry for entry in read_manifest(manifest).files} if manifest.is_file() else {}


def _listed_beside(path: Path) -> dict[str, FileEntry]:
    """Return what a manifest beside a file states; one that cannot be read does not matter for a file that is named."""
    try:
        return _listed(path.parent)
    except MagsimError:
        return {}


def _of_folder(folder: Path, files: Sequence[Path]) -> Iterator[FlightInfo]:
    """Yield the flights of a folder: those of its index where it has one that can be read."""
    listed = _listed(folder)
    if not parquet.is_there(folder):
        yield from _of_files(files, listed)
        return
    for info in parquet.read_flights(folder / parquet.INDEX, files).values():
        entry = listed.get(info.file_name)
        yield info if entry is None or entry.group is None else replace(info, group=entry.group, level=entry.level)


def _of_files(files: Sequence[Path], listed: Mapping[str, FileEntry]) -> Iterator[FlightInfo]:
    """Yield the flights of files, with what a manifest states of them."""
    if len(files) > 1:
        inspection.inspect_many(files)
    for path in files:
        entry = listed.get(path.name)
        for info in index_file(path):
            yield info if entry is None else replace(info, group=entry.group, level=entry.level)


def groups_of(data: Data) -> tuple[Group, ...]:
    """Sort flights into groups.

    A manifest that names groups decides. Else, in a folder with an index, each flight is a group if every flight holds
    both training and test rows, and all flights are one group if not. Else, where every file holds both, each file is a
    group. Else all that was given is one group.

    Parameters
    ----------
    data : Recording, Dataset, Path, str, or several of them

    Returns
    -------
    tuple of Group
        In the order of their first flights, with different names.

    Raises
    ------
    RequestError, DataError
        As ``flights_of``.
    """
    flights = flights_of(data)
    if flights and all(info.group is not None for info in flights):
        keys = [(_folder(info), str(info.group)) for info in flights]
    elif flights and all(info.file is not None for info in flights) and _files_are_whole(flights):
        keys = [(_folder(info), Path(info.file_name).stem) for info in flights]
    else:
        return (Group(EVERYTHING, flights),) if flights else ()
    members: dict[tuple[str, str], list[FlightInfo]] = {}
    for info, key in zip(flights, keys, strict=True):
        members.setdefault(key, []).append(info)
    found: dict[str, Group] = {}
    for key, own in members.items():
        name = _unused(key[1], found)
        found[name] = Group(name, tuple(own))
    return tuple(found.values())


def _unused(name: str, used: Container[str]) -> str:
    """Return a name that is not in use: two folders may have groups of one name."""
    numbered = (name if number == 1 else f"{name} ({number})" for number in count(1))
    return next(one for one in numbered if one not in used)


def _folder(info: FlightInfo) -> str:
    return "" if info.file is None else str(info.file.parent)


def _files_are_whole(flights: tuple[FlightInfo, ...]) -> bool:
    """Whether every file holds both training and test rows."""
    splits: dict[Path | None, set[str]] = {}
    for info in flights:
        splits.setdefault(info.file, set()).update(info.splits)
    return all({"train", "test"} <= found for found in splits.values())
