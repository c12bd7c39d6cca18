"""A data set: a folder of recording files, its flights and splits, and the manifest that lists them.

``manifest.json`` lists the files that belong to the data set, with their checksums, and the kind of machine that made
them. A folder without one is a data set too, of all its recording files.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

from magsim import columns
from magsim.dataset.index import FlightInfo, index_file, recording_files
from magsim.dataset.manifest import MANIFEST, Manifest, read_manifest
from magsim.errors import DataError, RequestError
from magsim.recording import Recording, read_recordings
from magsim.recording.windows import Windows
from magsim.storage import checksum, inspection


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
        if not isinstance(folder, str | Path):
            msg = f"data set: is of type {type(folder).__name__}; allowed: the path of a folder of recording files"
            raise RequestError(msg)
        self.folder = Path(folder)
        self.files = recording_files(self.folder)
        if check:
            self.check()
        inspection.inspect_many(self.files)
        self.flights: dict[str, FlightInfo] = {}
        for path in self.files:
            for info in index_file(path):
                if info.name in self.flights:
                    msg = f"{path}: flight {info.name!a} is in {self.flights[info.name].file_name} already"
                    raise DataError(msg)
                self.flights[info.name] = info

    def __len__(self) -> int:
        """Return the number of flights."""
        return len(self.flights)

    def __iter__(self) -> Iterator[Recording]:
        """Yield all flights, one file in memory at a time."""
        for path in self.files:
            yield from read_recordings(path)

    def __getitem__(self, name: str) -> Recording:
        """Read the flight of a name.

        Raises
        ------
        KeyError
            If there is none.
        """
        if name not in self.flights:
            msg = f"{self.folder}: there is no flight {name!r}; it has {', '.join(list(self.flights)[:12])}"
            raise KeyError(msg)
        return self.flights[name].read()

    @cached_property
    def manifest(self) -> Manifest:
        """The manifest; see ``read_manifest`` for what it raises."""
        return read_manifest(self.folder / MANIFEST)

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
        """Return memory-mapped windows of every flight, or of those in some files: see ``magsim.recording.windows``.

        They feed ``magsim.training.RandomBatches`` as windows in memory do. All flights must have the same columns.

        Raises
        ------
        RequestError
            If there is no such file or column.
        """
        paths = self.files if files is None else [self.folder / name for name in files]
        return Windows(paths, rows=rows, role=role, names=names, splits=splits)

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
