"""The end of a sweep: once every file is finished, what makes its folder a data set is written."""

import hashlib
from dataclasses import dataclass

from magsim.dataset import MANIFEST, FileEntry, Manifest, parquet
from magsim.errors import RequestError
from magsim.storage import atomic_text
from magsim.storage.machine import fingerprint
from magsim.sweep.index import write_index
from magsim.sweep.journal import Journal, file_name
from magsim.sweep.plan import SweepPlan
from magsim.sweep.report import REPORT, Tally, records, write_failures, write_report

MOST_LISTED = 20_000
"""Flights of a manifest; the index alone lists more."""


@dataclass(frozen=True)
class SweepOutcome:
    """What a sweep has flown.

    Attributes
    ----------
    tally : Tally
    digest : str
        SHA-256 over the checksums of all files and the flights that failed: the same wherever and however often the
        sweep was flown.
    """

    tally: Tally
    digest: str


def check_ready() -> None:
    """Raise an error if a sweep could not be finished, before any flight is flown.

    Raises
    ------
    RequestError
        If pyarrow is missing.
    """
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        msg = 'the index of a sweep is a Parquet file, which needs pyarrow: pip install "aeromagsim[parquet]"'
        raise RequestError(msg) from None


def finish(plan: SweepPlan, journal: Journal) -> SweepOutcome | None:
    """Write index, manifest, failures and report of a sweep whose files are all finished.

    Parameters
    ----------
    plan : SweepPlan
    journal : Journal
        Of its folder.

    Returns
    -------
    SweepOutcome or None
        None while files are missing: other parts are still flown. Then only the failures are written.
    """
    tally, digest, done = Tally(), hashlib.sha256(), 0
    files: list[FileEntry] = []
    for record in records(plan, journal):
        done += 1
        tally.add(record)
        digest.update(f"{record.shard} {record.sha256}\n".encode())
        for failed in record.failed:
            digest.update(f"{failed.number} {failed.kind}\n".encode())  # a reason may name a path of this machine
        if record.sha256 is not None and tally.flown <= MOST_LISTED:
            entries = tuple(flown.entry for flown in record.flown)
            name = file_name(record.shard)
            files.append(FileEntry(name=name, sha256=record.sha256, size=record.size, flights=entries))
    write_failures(plan, journal)
    if done < plan.shards:
        return None
    if tally.flown <= MOST_LISTED and files:
        manifest = Manifest(manifest=1, dataset=plan.dataset_name, made_on=fingerprint(), files=tuple(files))
        text = manifest.to_json()
        path = journal.folder / MANIFEST
        atomic_text(path, text, force=True)
    write_index(plan, journal, journal.folder / parquet.INDEX, tally.sensors)
    write_report(tally, journal.folder / REPORT)
    return SweepOutcome(tally, digest.hexdigest())
