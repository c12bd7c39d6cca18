"""What differs between the files of a data set and what its manifest or its index states of them."""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path

from magsim.dataset import parquet
from magsim.dataset.index import FlightInfo, index_file, recording_files
from magsim.dataset.manifest import MANIFEST, Manifest
from magsim.errors import DataError
from magsim.storage.checksum import checksum_state


def manifest_differences(folder: Path, manifest: Manifest, files: Sequence[Path]) -> list[str]:
    """Compare names and checksums of files with a manifest; a line for each file that differs."""
    listed = {entry.name: entry for entry in manifest.files}
    present = {path.name: path for path in files}
    lines = [f"{folder / name}: is missing, {MANIFEST} lists it" for name in listed if name not in present]
    lines += [f"{path}: {MANIFEST} does not list it" for name, path in present.items() if name not in listed]
    for name, path in present.items():
        if name in listed and checksum_state(path).digest != listed[name].sha256:
            lines.append(f"{path}: is not the file that {MANIFEST} lists: its sha256 differs")
    return lines


def index_differences(folder: Path, progress: Callable[[str], None] | None = None) -> list[str]:
    """Read every file of a folder and compare it with the index, and with the checksum at its own end.

    Parameters
    ----------
    folder : Path
    progress : callable, optional
        Called with a line of text for each file.

    Returns
    -------
    list of str
        A line for each difference; names of files first, then what is in them.

    Raises
    ------
    RequestError
        If there is no such folder or index, or pyarrow is not installed.
    DataError
        If it is no index.
    """
    files = recording_files(folder)
    listed = parquet.read_listed(folder / parquet.INDEX)
    sums = listed.checksums()
    lines = [f"{folder / parquet.INDEX}: {text}" for text in parquet.differences_of(listed.sizes(), files)]
    flights = {name: [*part] for name, part in groupby(listed.values(), lambda info: info.file_name)}
    for number, path in enumerate(files, start=1):
        if path.name in sums:
            if progress is not None:
                progress(f"{path}: file {number} of {len(files)}")
            lines += _file_differences(path, sums[path.name], flights[path.name])
    return lines


def _file_differences(path: Path, sha256: str, flights: Sequence[FlightInfo]) -> list[str]:
    try:
        state = checksum_state(path)
        if state.kind == "broken":
            return [f"{path}: {state.reason}"]
        if state.digest != sha256:
            return [f"{path}: is not the file that {parquet.INDEX} lists: its sha256 differs"]
        found = [_essence(info) for info in index_file(path)]
    except DataError as error:
        return [str(error)]
    if found != [_essence(info) for info in flights]:
        return [f"{path}: has other flights, rows or splits than {parquet.INDEX} lists"]
    return []


def _essence(info: FlightInfo) -> tuple[str, int, Mapping[str, int], int]:
    return info.name, info.rows, dict(info.splits), info.number
