"""Contents of a folder of recordings, from the files themselves: manifest, samples, statistics."""

from dataclasses import dataclass
from pathlib import Path

from magsim.dataset import Dataset, FileEntry, FlightEntry, Manifest
from magsim.generation.description import samples, statistics
from magsim.generation.description.samples import ColumnSample, Samples
from magsim.generation.description.statistics import Statistic, Statistics
from magsim.recording import read_recordings
from magsim.recording.verify import verify


@dataclass(frozen=True)
class Contents:
    """Manifest, samples and statistics of the files of a folder."""

    manifest: Manifest
    samples: Samples
    statistics: Statistics


def contents_of(folder: Path, dataset: str, made_on: dict[str, str], count: int) -> Contents:
    """Read every file of a folder.

    Parameters
    ----------
    folder : Path
    dataset : str
        Name of the data set.
    made_on : dict
        The kind of machine that made it, see ``storage.machine.fingerprint``.
    count : int
        Rows of each flight to sample.

    Raises
    ------
    DataError
        If a file is damaged.
    """
    entries: list[FileEntry] = []
    lines: dict[tuple[str, str], ColumnSample] = {}
    table: dict[tuple[str, str, str], Statistic] = {}
    for path in Dataset(folder).files:
        found = verify(path)
        recordings = read_recordings(path)
        flights = tuple(FlightEntry.of(recording) for recording in recordings)
        entries.append(FileEntry(name=path.name, sha256=found.digest, size=found.size, flights=flights))
        for recording in recordings:
            lines.update(samples.take(recording, count))
        table |= statistics.of_file(path.name, recordings)
    manifest = Manifest(manifest=1, dataset=dataset, made_on=made_on, files=tuple(entries))
    return Contents(manifest, lines, table)
