"""Whether a data set is what a manifest says: in every byte, or within the tolerances of another machine."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from magsim import columns
from magsim.dataset import MANIFEST, Dataset, FileEntry, FlightEntry, Manifest, read_manifest
from magsim.errors import DataError, RequestError
from magsim.generation.description import samples, statistics
from magsim.generation.description.contents import Survey, survey
from magsim.generation.description.samples import SAMPLES, Samples
from magsim.storage.machine import differences

MOST = 20
"""Differences that are told."""


@dataclass(frozen=True)
class Verdict:
    """How a data set agrees with a manifest.

    Attributes
    ----------
    kind : str
        ``bytes``: every file is identical. ``samples``: another kind of machine made it, and its numbers agree.
        ``own``: there was no manifest but the one beside the files.
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
    """A manifest with its samples: what a data set shall be."""

    path: Path
    manifest: Manifest
    samples: Samples

    @classmethod
    def read(cls, folder: Path) -> "Reference":
        """Read both from the folder of a recipe.

        Raises
        ------
        RequestError
            If they are not there.
        DataError
            If they are broken, or do not belong together.
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
        """Rows of the longest flight that are kept."""
        return max(len(line.values) for line in self.samples.values())


def compare(found: Survey, reference: Reference) -> Verdict:
    """Hold a data set against the manifest that it shall have.

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
        return Verdict("bytes", f"{files}, identical in every byte to the manifest")
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
    return Verdict("samples", text, worst_nt)


def _differs(reference: Reference, lines: list[str], *more: str) -> DataError:
    cut = [f"{len(lines) - MOST} more differences"] if len(lines) > MOST else []
    return DataError("\n".join([*lines[:MOST], *cut, *more, f"so this is not the data set of {reference.path}"]))


def _structure(found: Manifest, wanted: Manifest) -> Iterator[str]:
    """Differences in files, flights, rows and splits."""
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
                yield f"{name}: flight {one.name} has {_told(one)}; expected {_told(other)}"


def _told(flight: FlightEntry) -> str:
    return f"{flight.rows} rows, {', '.join(f'{count} {word}' for word, count in flight.splits.items())}"


def _first_difference(entry: FileEntry, found: Survey, reference: Reference) -> str:
    """The first column of a file that is not the same in every bit, and where that shows."""
    said = f"{entry.name}: is not identical in every byte, though the same kind of machine made it"
    for flight in entry.flights:
        here, there = (_columns(kept, flight.name) for kept in (found.samples, reference.samples))
        if list(here) != list(there):
            odd = sorted(set(here) ^ set(there)) or ["another order"]
            return f"{said}; flight {flight.name}: columns differ: {', '.join(odd[:5])}"
        for column, line in here.items():
            if line.digest == there[column].digest:
                continue
            said += f"; flight {flight.name}, column {column}"
            rows = samples.sampled_rows(flight.rows, len(there[column].values)).tolist()
            for row, one, other in zip(rows, line.values, there[column].values, strict=True):
                if one != other:
                    return f"{said}: row {row} is {one:.12g}, in the manifest {other:.12g}"
            return f"{said}: by less than the digits of the rows that are kept, or between them"
    return f"{said}; all columns are the same in every bit: what is told about the flights differs"


def _columns(kept: Samples, flight: str) -> dict[str, samples.Line]:
    return {column: line for (name, column), line in kept.items() if name == flight}


def _out_of_tolerance(found: Survey, reference: Reference) -> tuple[list[str], float]:
    """Every column that does not agree, and the largest difference of all samples in nT."""
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
            apart, said = _apart(column, line, there[column], entry.rows)
            if said:
                lines.append(f"{where}, column {column}: {said}")
            if columns.find(column).unit == "nT":
                worst_nt = max(worst_nt, apart)
    return lines, worst_nt


def _apart(column: str, line: samples.Line, wanted: samples.Line, rows: int) -> tuple[float, str]:
    """Largest difference of the rows that are kept, and what is wrong with the column, if anything."""
    allowed, unit = samples.tolerance(column), columns.find(column).unit
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


def check_folder(folder: Path, reference: Reference | None) -> Verdict:
    """Check a data set that was built before.

    Its files are held against their own checksums, against the manifest that lies beside them, and against the one that
    the data set shall have, if that is known.

    Parameters
    ----------
    folder : Path
    reference : Reference, optional

    Raises
    ------
    RequestError
        If it is no folder of a data set.
    DataError
        If anything differs: one line for each difference.
    """
    dataset = Dataset(folder)
    own = dataset.manifest
    found = survey(folder, own.dataset, own.made_on, reference.count if reference else 2)
    if reference is not None:
        verdict = compare(found, reference)
    else:
        verdict = Verdict("own", f"as {MANIFEST} beside the files lists them; there is no recipe to compare with")
    dataset.check()
    told = folder / statistics.STATISTICS
    if told.is_file() and told.read_bytes() != statistics.to_text(found.statistics).encode():
        msg = f"{told}: is not the statistics of these files"
        raise DataError(msg)
    return verdict


def reference_of(dataset: str, folder: Path | None) -> Reference | None:
    """What a data set of a name shall be; None where its recipe has no manifest.

    Raises
    ------
    RequestError
        If the recipe is of another data set.
    DataError
        If the manifest is broken.
    """
    if folder is None or not (folder / MANIFEST).is_file():
        return None
    reference = Reference.read(folder)
    if reference.manifest.dataset != dataset:
        msg = f"{folder}: is the recipe of {reference.manifest.dataset}, not of {dataset}"
        raise RequestError(msg)
    return reference
