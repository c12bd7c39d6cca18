"""A data set: a folder of recording files, its flights and splits, and the manifest that lists them.

``manifest.json`` says which files belong to the data set, with their checksums, and what kind of machine made them. A
folder without one is a data set too, of all its recording files.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationError

from magsim import columns
from magsim.config import Name, Strict
from magsim.errors import DataError, RequestError
from magsim.files import first_bytes
from magsim.recording import Recording, file
from magsim.recording.windows import Windows
from magsim.storage import checksum, hdf5, inspection

MANIFEST = "manifest.json"
"""Name of the file that lists a data set."""

MAX_BYTES = 100_000_000
"""Largest manifest, or other text beside the data, that is read."""

Count = Annotated[int, Field(ge=0)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Text = Annotated[str, Field(max_length=1000)]


class FlightEntry(Strict):
    """One flight as a manifest lists it."""

    name: Name
    rows: Count
    digest: Text = Field(description="of the scenario with its aircraft")
    splits: dict[Literal["train", "valid", "test"], Count] = Field(description="rows of each split")


class FileEntry(Strict):
    """One recording file as a manifest lists it."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*\.h5$", max_length=60)]
    sha256: Sha256
    size: Count
    flights: tuple[FlightEntry, ...]


class Manifest(Strict):
    """The files of a data set and the kind of machine that made them."""

    manifest: Literal[1] = Field(description="version of this format")
    dataset: Name
    made_on: dict[Annotated[str, Field(max_length=40)], Text] = Field(
        description="versions and processor features that decide the last bits"
    )
    files: tuple[FileEntry, ...]

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(entry.size for entry in self.files)

    @property
    def flights(self) -> Mapping[str, FlightEntry]:
        """All flights by name."""
        return {flight.name: flight for entry in self.files for flight in entry.flights}

    def to_json(self) -> str:
        """The text of the file: the same for the same manifest."""
        return json.dumps(self.model_dump(mode="json"), indent=1) + "\n"


def read_bounded(path: Path) -> bytes:
    """Bytes of a file that describes a data set.

    Raises
    ------
    RequestError
        If it cannot be read.
    DataError
        If it is too large to be one.
    """
    data = first_bytes(path, MAX_BYTES + 1, kind="a file")
    if len(data) > MAX_BYTES:
        msg = f"{path}: is larger than {MAX_BYTES // 1_000_000} MB, so it describes no data set"
        raise DataError(msg)
    return data


def read_manifest(path: Path) -> Manifest:
    """Read a manifest from anywhere.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is no manifest.
    """
    data = read_bounded(path)
    try:
        return Manifest.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        msg = f"{path}: is no manifest of a data set: {where + ': ' if where else ''}{first['msg']}"
        raise DataError(msg) from None


@dataclass(frozen=True)
class FlightInfo:
    """Where a flight of a data set is and what its rows are for.

    Attributes
    ----------
    name : str
    file : Path
    rows : int
    splits : mapping of str to int
        Rows of each split that it has, in the order train, valid, test; empty where rows have no split.
    """

    name: str
    file: Path
    rows: int
    splits: Mapping[str, int]


class Dataset:
    """A folder of recording files.

    Hidden files, such as those that are being written, do not count. Flights are read when they are asked for.

    Parameters
    ----------
    folder : Path or str
    check : bool
        Compare every file with the checksum in the manifest.

    Attributes
    ----------
    folder : Path
    files : tuple of Path
        In the order of their names.
    flights : mapping of str to FlightInfo
        By name, in the order of the files.

    Raises
    ------
    RequestError
        If there is no such folder, or it has no recording; with ``check``, if it has no manifest.
    DataError
        If a file is no recording or is damaged, two flights have one name, or a checksum differs.
    """

    def __init__(self, folder: Path | str, *, check: bool = False) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            msg = f"{self.folder}: there is no such folder"
            raise RequestError(msg)
        self.files = tuple(sorted(p for p in self.folder.glob("*.h5") if not p.name.startswith(".")))
        if not self.files:
            msg = f"{self.folder}: this folder has no recording (*.h5)"
            raise RequestError(msg)
        if check:
            self.check()
        inspection.inspect_many(self.files)
        self.flights: dict[str, FlightInfo] = {}
        for path in self.files:
            for info in _index(path):
                if info.name in self.flights:
                    msg = f"{path}: flight {info.name!a} is in {self.flights[info.name].file.name} already"
                    raise DataError(msg)
                self.flights[info.name] = info

    def __len__(self) -> int:
        """Number of flights."""
        return len(self.flights)

    def __iter__(self) -> Iterator[Recording]:
        """All flights, one file in memory at a time."""
        for path in self.files:
            yield from file.read(path)

    def __getitem__(self, name: str) -> Recording:
        """The flight of a name.

        Raises
        ------
        KeyError
            If there is none.
        """
        if name not in self.flights:
            msg = f"{self.folder}: there is no flight {name!r}; it has {', '.join(list(self.flights)[:12])}"
            raise KeyError(msg)
        return file.read_one(self.flights[name].file, name)

    @cached_property
    def manifest(self) -> Manifest:
        """What the manifest says; see ``read_manifest`` for what it raises."""
        return read_manifest(self.folder / MANIFEST)

    def split(self, name: str) -> list[Recording]:
        """The rows of one split of every flight that has any: ``split("train")``.

        Raises
        ------
        ValueError
            If there is no such split.
        """
        if name not in columns.SPLITS.values():
            msg = f"there is no split {name!r}; allowed: {', '.join(columns.SPLITS.values())}"
            raise ValueError(msg)
        told = [info for info in self.flights.values() if info.splits.get(name, 0) >= 2]
        return [self[info.name].where(split=name) for info in told]

    def windows(self, rows: int, *, role: str = "input", files: tuple[str, ...] | None = None) -> Windows:
        """Memory-mapped windows of every flight, or of those in some files: see ``magsim.recording.windows``.

        All flights must have the same columns.

        Raises
        ------
        RequestError
            If there is no such file.
        """
        if files is None:
            return Windows(self.files, rows=rows, role=role)
        return Windows([self.folder / name for name in files], rows=rows, role=role)

    def check(self) -> None:
        """Compare names and checksums of the files with the manifest.

        Raises
        ------
        RequestError
            If there is no manifest.
        DataError
            If anything differs: one line for each file.
        """
        listed = {entry.name: entry for entry in self.manifest.files}
        present = {path.name: path for path in self.files}
        lines = [f"{self.folder / name}: is missing, {MANIFEST} lists it" for name in listed if name not in present]
        lines += [f"{path}: {MANIFEST} does not list it" for name, path in present.items() if name not in listed]
        for name, path in present.items():
            if name in listed and checksum.checksum_state(path).digest != listed[name].sha256:
                lines.append(f"{path}: is not the file that {MANIFEST} lists: its sha256 differs")
        if lines:
            raise DataError("\n".join(lines))


def _index(path: Path) -> Iterator[FlightInfo]:
    """The flights of a file, by their names, rows and splits alone."""
    with hdf5.open_untrusted(path) as root:
        for group in file.flight_groups(root):
            rows = len(group.array(columns.TIME, kind="f", ndim=1))
            yield FlightInfo(file.flight_name(group), path, rows, _splits(group))


def _splits(group: hdf5.Reader) -> dict[str, int]:
    if "segment" not in group.names():
        return {}
    names = [name.decode("utf-8", "replace") for name in group.array("segment_channel", kind="S", ndim=1).tolist()]
    block = group.array("segment", kind="f", ndim=2)
    if block.shape[1] != len(names):
        group.refuse(f"segment has {block.shape[1]} columns, but segment_channel has {len(names)} names")
    return split_rows(block[:, names.index(columns.SPLIT.pattern)]) if columns.SPLIT.pattern in names else {}


def split_rows(codes: np.ndarray) -> dict[str, int]:
    """Rows of each split that occurs in a column ``split``, in the order train, valid, test."""
    counts = {word: int(np.count_nonzero(codes == code)) for code, word in columns.SPLITS.items()}
    return {word: count for word, count in counts.items() if count}
