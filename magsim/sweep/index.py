"""The index of a sweep: one row for each flight, with every value that varies, what became of it, and where it lies."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from magsim import columns
from magsim.dataset import parquet
from magsim.errors import DataError
from magsim.sweep.journal import Journal, ShardRecord, file_name
from magsim.sweep.plan import SweepPlan
from magsim.sweep.report import plain, records
from magsim.sweep.space import SweptFlight

_OF_FAILED = {
    "file": None,
    "number": -1,
    "rows": 0,
    "train_rows": 0,
    "valid_rows": 0,
    "test_rows": 0,
    "duration_s": 0.0,
    "digest": None,
    "sha256": None,
}

INT64 = range(-(2**63), 2**63)


def write_index(plan: SweepPlan, journal: Journal, path: Path, sensors: Sequence[str]) -> None:
    """Write the index of the finished files of a sweep, a part of it in memory at a time.

    Parameters
    ----------
    plan : SweepPlan
    journal : Journal
    path : Path
    sensors : sequence of str
        Scalar magnetometers that any of the flights has: their names may vary.

    Raises
    ------
    RequestError
        If it cannot be written.
    DataError
        If a record has a flight that its file cannot have.
    """
    examples = plan.space.examples().items()
    # what varies and is a column of every index, the seed, has no second one
    swept = {name: _type(values) for name, values in examples if name not in parquet.COLUMNS}
    figures = {parquet.FIGURE.format(sensor=sensor): "double" for sensor in sensors}
    rows = (row for record in records(plan, journal) for row in _rows(plan, journal, record, swept))
    parquet.write_index(path, rows, {**swept, **figures})


def _type(values: Sequence[object]) -> str:
    """Return the type of a column that holds such values."""
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return "bool"
    if kinds == {int}:
        return "int64" if all(value in INT64 for value in values) else "string"
    return "double" if kinds <= {int, float} else "string"


def _rows(plan: SweepPlan, journal: Journal, record: ShardRecord, swept: dict[str, str]) -> Iterator[dict[str, object]]:
    """Yield the rows of a finished file: first the flights in it, in order, then those that failed."""
    flights = plan.flights_by_number(record.shard)
    numbers = {*(flight.number for flight in record.flown), *(flight.number for flight in record.failed)}
    if strange := numbers - flights.keys():
        msg = (
            f"{journal.path(record.shard)}: is damaged: flight {min(strange)} does not belong to this file; "
            "allowed: to remove the record, and to fly the file again with --resume"
        )
        raise DataError(msg)
    for number, flown in enumerate(record.flown):
        entry = flown.entry
        yield {
            **_row(flights[flown.number], swept),
            "flown": True,
            "failure": None,
            "file": file_name(record.shard),
            "number": number,
            "rows": entry.rows,
            **{f"{split}_rows": entry.rows_in(split) for split in columns.SPLITS.values()},
            "duration_s": flown.duration_s,
            "digest": entry.digest,
            "seed": flown.seed,
            "sha256": record.sha256,
            **{parquet.FIGURE.format(sensor=sensor): std for sensor, std in flown.interference_std_nt.items()},
        }
    for failed in record.failed:
        row = _row(flights[failed.number], swept)
        seed = flights[failed.number].values.get("seed")
        known = seed if type(seed) is int and seed in INT64 else None
        yield {**row, **_OF_FAILED, "seed": known, "flown": False, "failure": failed.reason}


def _row(flight: SweptFlight, swept: dict[str, str]) -> dict[str, object]:
    """Return what a flight's row has whatever became of it."""
    values = {
        name: str(plain(value)) if swept[name] == "string" and not isinstance(value, str) else value
        for name, value in flight.values.items()
        if name in swept
    }
    return {"flight": flight.number, "name": flight.name, **values}
