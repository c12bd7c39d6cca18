"""What is known of flights before their values are read: names, places, rows and splits."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from magsim import columns
from magsim.errors import RequestError
from magsim.recording import Recording, file
from magsim.storage import hdf5


@dataclass(frozen=True)
class FlightInfo:
    """Where a flight is and what its rows are for.

    Attributes
    ----------
    name : str
    rows : int
    splits : mapping of str to int
        Rows of each split that it has, in the order train, valid, test; empty where rows have no split.
    file : Path, optional
        None for a recording in memory.
    number : int
        Number of the flight in its file, from 0.
    recording : Recording, optional
        The recording itself where it is in memory.
    group : str, optional
        Name of its group in the manifest of its data set.
    level : int, optional
        Step of difficulty in that manifest.
    """

    name: str
    rows: int
    splits: Mapping[str, int]
    file: Path | None = None
    number: int = 0
    recording: Recording | None = None
    group: str | None = None
    level: int | None = None

    @classmethod
    def of(cls, recording: Recording) -> "FlightInfo":
        """Describe a recording in memory."""
        split = recording.data.get(columns.SPLIT.pattern)
        return cls(recording.name, len(recording), {} if split is None else split_rows(split), recording=recording)

    @property
    def file_name(self) -> str:
        """Name of the file without its folder; empty for a recording in memory."""
        return "" if self.file is None else self.file.name

    def read(self) -> Recording:
        """Return the recording, read from its file if need be.

        Raises
        ------
        DataError
            If the file is damaged.
        """
        if self.recording is not None:
            return self.recording
        assert self.file is not None
        return Recording(*file.read_number(self.file, self.number))


def recording_files(folder: Path) -> tuple[Path, ...]:
    """List the recording files of a folder in the order of their names; hidden ones are being written.

    Raises
    ------
    RequestError
        If there is no such folder, or it has no recording.
    """
    if not folder.is_dir():
        msg = f"{folder}: there is no such folder"
        raise RequestError(msg)
    return file.files_of(folder)


def index_file(path: Path) -> Iterator[FlightInfo]:
    """Yield the flights of a file, by their names, rows and splits alone.

    Raises
    ------
    RequestError
        If there is no such file.
    DataError
        If it is no recording or is damaged.
    """
    with hdf5.open_untrusted(path) as root:
        for number, group in enumerate(file.flight_groups(root)):
            rows = len(group.array(columns.TIME, kind="f", ndim=1))
            yield FlightInfo(file.flight_name(group), rows, _splits(group), path, number)


def _splits(group: hdf5.Reader) -> dict[str, int]:
    if "segment" not in group.names():
        return {}
    names = [name.decode("utf-8", "replace") for name in group.array("segment_channel", kind="S", ndim=1).tolist()]
    block = group.array("segment", kind="f", ndim=2)
    if block.shape[1] != len(names):
        group.refuse(f"segment has {block.shape[1]} columns, but segment_channel has {len(names)} names")
    return split_rows(block[:, names.index(columns.SPLIT.pattern)]) if columns.SPLIT.pattern in names else {}


def split_rows(codes: np.ndarray) -> dict[str, int]:
    """Count the rows of each split that occurs in a column ``split``, in the order train, valid, test."""
    counts = {word: int(np.count_nonzero(codes == code)) for code, word in columns.SPLITS.items()}
    return {word: count for word, count in counts.items() if count}
