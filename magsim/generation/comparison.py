"""Comparison of a data set with its manifest: in every byte, or within tolerances on another kind of machine."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from magsim import columns
from magsim.dataset import MANIFEST, Dataset, FileEntry, FlightEntry, Manifest, read_manifest
from magsim.errors import DataError, RequestError
from magsim.generation.description import samples, statistics
from magsim.generation.description.contents import Contents, contents_of
from magsim.generation.description.samples import SAMPLES, Samples
from magsim.storage.machine import differences

MOST = 20
"""Most differences that are listed."""


@dataclass(frozen=True)
class Agreement:
    """Agreement of a data set with a manifest.

    Attributes
    ----------
    kind : str
        ``bytes``: every file is identical. ``samples``: another kind of machine made it, and its samples agree.
        ``own``: there was no other manifest than the one beside the files.
    text : str
        For people, one line.
    worst_nt : float
        Largest difference of a sample in nT; 0 for ``bytes``.
    """

    kind: str
    text: str
    worst_nt: float = 0.0


@dataclass(frozen=True)
class Reference:
    """A manifest with its samples, to compare a data set with."""

    path: Path
    manifest: Manifest
    samples: Samples

    @classmethod
    def read(cls, folder: Path) -> "Reference":
        """Read manifest and samples from the folder of a recipe.

        Raises
        ------
        RequestError
            If they do not exist.
        DataError
            If they are damaged, or do not belong together.
        """
        manifest, kept = read_manifest(folder / MANIFEST), samples.read(folder / SAMPLES)
        count = max((len(line.values) for line in kept.values()), default=0)
        fits = {flight for flight, _ in kept} == set(manifest.flights) and all(
            len(line.values) == len(samples.sampled_rows(manifest.flights[flight].rows, count))
            for (flight, _), line in kept.items()
        )
        if not fits:
            msg = f"{folder / SAMPLES}: its flights or rows are not those of {MANIFEST}"
            raise DataError(msg)
        return cls(folder / MANIFEST, manifest, kept)

    @property
    def count(self) -> int:
        """Number of sampled rows of the longest flight."""
        return max(len(line.values) for line in self.samples.values())


def compare(found: Contents, reference: Reference) -> Agreement:
    """Compare a data set with its manifest.

    Raises
    ------
    DataError
        If it is another data set: one line for each difference, with file, flight, column and row.
    """
    wanted = reference.manifest
    lines = [*_structure(found.manifest, wanted)]
    if lines:
        raise _differs(reference, lines)
    files = f"{len(wanted.files)} files" if len(wanted.files) > 1 else "1 file"
    pairs = list(zip(found.manifest.files, wanted.files, strict=True))
    if all(one.sha256 == other.sha256 for one, other in pairs):
        return Agreement("bytes", f"{files}, identical in every byte to the manifest")
    other_machine = differences(found.manifest.made_on, wanted.made_on)
    if not other_machine:
        raise _differs(reference, [_first_difference(one, found, reference) for one, other in pairs if one != other])
    lines, worst_nt = _out_of_tolerance(found, reference)
    if lines:
        raise _differs(reference, lines, f"made on another kind of machine: {'; '.join(other_machine)}")
    text = (
        f"{files}, samples of every column agree, the largest difference is {worst_nt:.2g} nT of "
        f"{samples.TOLERANCES['nT']:g} allowed; the bytes differ, for another kind of machine made the manifest "
        f"({'; '.join(other_machine)})"
    )
    return Agreement("samples", text, worst_nt)


def _differs(reference: Reference, lines: list[str], *more: str) -> DataError:
    cut = [f"{len(lines) - MOST} more differences"] if len(lines) > MOST else []
    return DataError("\n".join([*lines[:MOST], *cut, *more, f"so this is not the data set of {reference.path}"]))


def _structure(found: Manifest, wanted: Manifest) -> Iterator[str]:
    """Yield differences in files, flights, rows and splits."""
    here, there = ({entry.name: entry for entry in manifest.files} for manifest in (found, wanted))
    yield from (f"{name}: is missing" for name in there if name not in here)
    yield from (f"{name}: is not part of it" for name in here if name not in there)
    for name, entry in here.items():
        if name not in there:
            continue
        flights = [flight.name for flight in entry.flights]
        expected = [flight.name for flight in there[name].flights]
        if flights != expected:
            yield f"{name}: has the flights {', '.join(flights)}; expected {', '.join(expected)}"
            continue
        for one, other in zip(entry.flights, there[name].flights, strict=True):
            if (one.rows, one.splits) != (other.rows, other.splits):
                yield f"{name}: flight {one.name} has {_splits(one)}; expected {_splits(other)}"


def _splits(flight: FlightEntry) -> str:
    return f"{flight.rows} rows, {', '.join(f'{count} {word}' for word, count in flight.splits.items())}"


def _first_difference(entry: FileEntry, found: Contents, reference: Reference) -> str:
    """Describe the first column of a file that differs in any bit, and its first sample that differs."""
    text = f"{entry.name}: is not identical in every byte, though the same kind of machine made it"
    for flight in entry.flights:
        here, there = (_columns(kept, flight.name) for kept in (found.samples, reference.samples))
        if list(here) != list(there):
            odd = sorted(set(here) ^ set(there)) or ["another order"]
            return f"{text}; flight {flight.name}: columns differ: {', '.join(odd[:5])}"
        for column, line in here.items():
            if line.digest == there[column].digest:
                continue
            text += f"; flight {flight.name}, column {column}"
            rows = samples.sampled_rows(flight.rows, len(there[column].values)).tolist()
            for row, one, other in zip(rows, line.values, there[column].values, strict=True):
                if one != other:
                    return f"{text}: row {row} is {one:.12g}, in the manifest {other:.12g}"
            return f"{text}: by less than the digits of the sampled rows, or between them"
    return f"{text}; all columns are the same in every bit: the metadata of the flights differ"


def _columns(kept: Samples, flight: str) -> dict[str, samples.ColumnSample]:
    return {column: line for (name, column), line in kept.items() if name == flight}


def _out_of_tolerance(found: Contents, reference: Reference) -> tuple[list[str], float]:
    """Describe every column that does not agree, and return the largest difference of all samples in nT."""
    lines: list[str] = []
    worst_nt = 0.0
    file_of = {flight.name: entry.name for entry in found.manifest.files for flight in entry.flights}
    for flight, entry in found.manifest.flights.items():
        here, there = (_columns(kept, flight) for kept in (found.samples, reference.samples))
        where = f"{file_of[flight]}: flight {flight}"
        if set(here) != set(there):
            lines.append(f"{where}: columns differ: {', '.join(sorted(set(here) ^ set(there))[:5])}")
            continue
        for column, line in here.items():
            apart, problem = _apart(column, line, there[column], entry.rows)
            if problem:
                lines.append(f"{where}, column {column}: {problem}")
            if columns.family_of(column).unit == "nT":
                worst_nt = max(worst_nt, apart)
    return lines, worst_nt


def _apart(column: str, line: samples.ColumnSample, wanted: samples.ColumnSample, rows: int) -> tuple[float, str]:
    """Return the largest difference of the sampled rows, and what is wrong with the column; empty if nothing."""
    allowed, unit = samples.tolerance(column), columns.family_of(column).unit
    pairs = zip(line.values, wanted.values, strict=True)
    apart = [samples.distance(column, one, other) for one, other in pairs]
    numbers = samples.sampled_rows(rows, len(wanted.values)).tolist()
    for number, value in zip(numbers, apart, strict=True):
        if value > allowed:
            return max(apart), f"row {number} is {value:.3g} {unit} from the manifest's; allowed: {allowed:g}"
    value, bound = samples.distance(column, line.total, wanted.total), samples.sum_tolerance(column, rows)
    if value > bound:
        return max(apart), f"the sum of all rows is {value:.3g} {unit} from the manifest's; allowed: {bound:.3g}"
    return max(apart), ""


def check_folder(folder: Path, reference: Reference | None) -> Agreement:
    """Check an existing data set.

    Its files are compared with their own checksums, with the manifest beside them, and with the reference, if given.

    Parameters
    ----------
    folder : Path
    reference : Reference, optional

    Raises
    ------
    RequestError
        If the folder is no data set.
    DataError
        If anything differs: one line for each difference.
    """
    dataset = Dataset(folder)
    own = dataset.manifest
    found = contents_of(folder, own.dataset, own.made_on, reference.count if reference else 2)
    if reference is not None:
        agreement = compare(found, reference)
    else:
        agreement = Agreement("own", f"as {MANIFEST} beside the files lists them; there is no recipe to compare with")
    dataset.check()
    table = folder / statistics.STATISTICS
    if table.is_file() and table.read_bytes() != statistics.to_text(found.statistics).encode():
        msg = f"{table}: is not the statistics of these files"
        raise DataError(msg)
    return agreement


def reference_of(dataset: str, folder: Path | None) -> Reference | None:
    """Return the reference of a data set; None if its recipe has no manifest.

    Raises
    ------
    RequestError
        If the recipe is of another data set.
    DataError
        If the manifest is damaged.
    """
    if folder is None or not (folder / MANIFEST).is_file():
        return None
    reference = Reference.read(folder)
    if reference.manifest.dataset != dataset:
        msg = f"{folder}: is the recipe of {reference.manifest.dataset}, not of {dataset}"
        raise RequestError(msg)
    return reference
