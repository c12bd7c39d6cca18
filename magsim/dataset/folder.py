"""A data set: a folder of recording files, its flights and splits, and the manifest that lists them.

``manifest.json`` lists the files that belong to the data set, with their checksums, and the kind of machine that made
them. ``index.parquet`` lists thousands of flights, so that a folder opens without a look into its files. A folder
without either is a data set too, of all its recording files.
"""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from magsim import columns
from magsim.dataset import parquet
from magsim.dataset.checking import index_differences, manifest_differences
from magsim.dataset.index import FlightInfo, index_file, recording_files
from magsim.dataset.manifest import MANIFEST, Manifest, read_manifest
from magsim.errors import DataError, RequestError
from magsim.recording import Recording
from magsim.recording.windows import Windows
from magsim.storage import inspection

if TYPE_CHECKING:
    import pandas as pd


class Dataset:
    """A folder of recording files.

    Hidden files, such as those that are being written, do not count. Flights are read when they are asked for. With an
    index, and pyarrow to read it, no file is opened before that: what opens it first checks it. Without one, every file
    is checked and opened at once.

    Parameters
    ----------
    folder : Path or str
    check : bool
        Compare every file with its checksum in the manifest or in the index.

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
        If there is no such folder, or it has no recording; with ``check``, if it has neither manifest nor index.
    DataError
        If the index does not fit the files; without an index, if a file is no recording or is damaged, or two flights
        have one name; with ``check``, if a checksum differs.
    """

    def __init__(self, folder: Path | str, *, check: bool = False) -> None:
        if not isinstance(folder, str | Path):
            msg = f"data set: is of type {type(folder).__name__}; allowed: the path of a folder of recording files"
            raise RequestError(msg)
        self.folder = Path(folder)
        self.files = recording_files(self.folder)
        if check:
            self.check()
        self.flights: Mapping[str, FlightInfo]
        if parquet.is_there(self.folder):
            self.flights = parquet.read_flights(self.folder / parquet.INDEX, self.files)
        else:
            self.flights = _flights_by_name(self.files)

    def __len__(self) -> int:
        """Return the number of flights."""
        return len(self.flights)

    def __iter__(self) -> Iterator[Recording]:
        """Yield all flights, one in memory at a time."""
        return (info.read() for info in self.flights.values())

    def __getitem__(self, name: str) -> Recording:
        """Read the flight of a name.

        Raises
        ------
        KeyError
            If there is none.
        """
        if name not in self.flights:
            msg = f"{self.folder}: there is no flight {name!r}; it has {', '.join(islice(self.flights, 12))}"
            raise KeyError(msg)
        return self.flights[name].read()

    @cached_property
    def manifest(self) -> Manifest:
        """The manifest; see ``read_manifest`` for what it raises."""
        return read_manifest(self.folder / MANIFEST)

    @property
    def index(self) -> "pd.DataFrame":
        """The index as a pandas DataFrame: a row for each flight, with what was varied and what came of it.

        Failed flights have rows too: ``index[index.flown]`` has none of them. ``name`` is that of the recording.

        Raises
        ------
        RequestError
            If the folder has none, or pyarrow is not installed.
        DataError
            If it is no index.
        """
        return parquet.read_frame(self.folder / parquet.INDEX)

    def split(self, name: str) -> list[Recording]:
        """Read the rows of one split of every flight that has any: ``split("train")``.

        Raises
        ------
        ValueError
            If there is no such split.
        """
        if name not in columns.SPLITS.values():
            msg = f"there is no split {name!r}; allowed: {', '.join(columns.SPLITS.values())}"
            raise ValueError(msg)
        having = [info for info in self.flights.values() if info.splits.get(name, 0) >= 2]
        return [info.read().where(split=name) for info in having]

    def windows(
        self,
        rows: int,
        *,
        role: str = "input",
        files: Sequence[str] | None = None,
        names: Sequence[str] | None = None,
        splits: Sequence[str] | None = None,
    ) -> Windows:
        """Return windows of every flight, or of those in some files: see ``magsim.recording.windows``.

        They feed ``magsim.training.RandomBatches`` as windows in memory do. All flights must have the same columns.

        Raises
        ------
        RequestError
            If there is no such file or column.
        """
        paths = self.files if files is None else [self.folder / name for name in files]
        return Windows(paths, rows=rows, role=role, names=names, splits=splits)

    def check(self) -> None:
        """Compare names and checksums of the files with the manifest and with the index, reading every file.

        Raises
        ------
        RequestError
            If there is neither.
        DataError
            If anything differs: one line for each file.
        """
        indexed = parquet.is_there(self.folder)
        lines = index_differences(self.folder) if indexed else []
        if (self.folder / MANIFEST).is_file() or not indexed:
            lines += manifest_differences(self.folder, self.manifest, self.files)
        if lines:
            raise DataError("\n".join(dict.fromkeys(lines)))


def files_of(data: Dataset | Path | str | Iterable[Dataset | Path | str]) -> tuple[Path, ...]:
    """List recording files without opening them; the index of a folder is compared with its files.

    Parameters
    ----------
    data : Dataset, Path, str, or several
        Data sets, folders, recording files.

    Raises
    ------
    RequestError
        If it is something else, or there is no such file or folder.
    DataError
        If an index does not fit the files.
    """
    if isinstance(data, Dataset):
        return data.files
    if isinstance(data, Path | str):
        path = Path(data)
        if not path.is_dir():
            if not path.is_file():
                msg = f"{path}: there is no such file or folder"
                raise RequestError(msg)
            return (path,)
        files = recording_files(path)
        if parquet.is_there(path):
            parquet.read_flights(path / parquet.INDEX, files)
        return files
    if isinstance(data, Iterable) and not isinstance(data, Recording):
        found = tuple(path for item in data for path in files_of(item))
        if found:
            return found
    name = type(data).__name__
    msg = f"{name} has no recording files; allowed: a Dataset, a folder, a recording file, or a list of these"
    raise RequestError(msg)


def _flights_by_name(files: Sequence[Path]) -> dict[str, FlightInfo]:
    """Open every file and list its flights."""
    if (files[0].parent / parquet.INDEX).is_file():
        msg = f"{files[0].parent}: all {len(files)} files are opened, since pyarrow, which reads the index, is missing"
        warnings.warn(msg, stacklevel=3)
    inspection.inspect_many(files)
    flights: dict[str, FlightInfo] = {}
    for path in files:
        for info in index_file(path):
            if info.name in flights:
                msg = f"{path}: flight {info.name!a} is in {flights[info.name].file_name} already"
                raise DataError(msg)
            flights[info.name] = info
    return flights
