"""What lies in a folder of recordings, counted from the files themselves."""

from dataclasses import dataclass
from pathlib import Path

from magsim import columns
from magsim.dataset import Dataset, FileEntry, FlightEntry, Manifest, split_rows
from magsim.generation.description import samples, statistics
from magsim.generation.description.samples import Samples
from magsim.generation.description.statistics import Statistics
from magsim.recording import Recording, read_recordings
from magsim.recording.verify import verify


@dataclass(frozen=True)
class Survey:
    """A manifest of some files with the samples that go with it, and their statistics."""

    manifest: Manifest
    samples: Samples
    statistics: Statistics


def survey(folder: Path, dataset: str, made_on: dict[str, str], count: int) -> Survey:
    """Look at every file of a folder.

    Parameters
    ----------
    folder : Path
    dataset : str
        Name of the data set.
    made_on : dict
        The machine that made it, see ``storage.machine.fingerprint``.
    count : int
        Rows of each flight to keep as samples.

    Raises
    ------
    DataError
        If a file is not sound in every byte.
    """
    entries, lines, table = [], {}, {}
    for path in Dataset(folder).files:
        found = verify(path)
        recordings = read_recordings(path)
        flights = tuple(_entry(recording) for recording in recordings)
        entries.append(FileEntry(name=path.name, sha256=found.digest, size=found.size, flights=flights))
        for recording in recordings:
            lines |= samples.take(recording, count)
        table |= statistics.of_file(path.name, recordings)
    manifest = Manifest(manifest=1, dataset=dataset, made_on=made_on, files=tuple(entries))
    return Survey(manifest, lines, table)


def _entry(recording: Recording) -> FlightEntry:
    splits = split_rows(recording[columns.SPLIT.pattern])
    digest = str(recording.meta.get("digest", ""))
    return FlightEntry(name=recording.name, rows=len(recording), digest=digest, splits=splits)
