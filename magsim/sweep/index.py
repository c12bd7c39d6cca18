"""The index of a sweep: one row for each flight, with every value that varies, what became of it, and where it lies."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from magsim import columns
from magsim.dataset import parquet
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
    "seed": None,
    "sha256": None,
}


def write_index(plan: SweepPlan, journal: Journal, path: Path) -> None:
    """Write the index of the finished files of a sweep, a part of it in memory at a time.

    Raises
    ------
    RequestError
        If it cannot be written.
    """
    swept = {name: _type(values) for name, values in plan.space.examples().items()}
    figures = {parquet.FIGURE.format(sensor=sensor.name): "double" for sensor in plan.base.scenario.sensors.scalar}
    rows = (row for record in records(plan, journal) for row in _rows(plan, record, swept))
    parquet.write_index(path, rows, {**swept, **figures})


def _type(values: Sequence[object]) -> str:
    """Return the type of a column that holds such values."""
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return "bool"
    if kinds == {int}:
        return "int64"
    return "double" if kinds <= {int, float} else "string"


def _rows(plan: SweepPlan, record: ShardRecord, swept: dict[str, str]) -> Iterator[dict[str, object]]:
    """Yield the rows of a finished file: first the flights in it, in order, then those that failed."""
    flights = plan.flights_by_number(record.shard)
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
        yield {**_row(flights[failed.number], swept), **_OF_FAILED, "flown": False, "failure": failed.reason}


def _row(flight: SweptFlight, swept: dict[str, str]) -> dict[str, object]:
    """Return what a flight's row has whatever became of it."""
    values = {
        name: str(plain(value)) if swept[name] == "string" and not isinstance(value, str) else value
        for name, value in flight.values.items()
    }
    return {"flight": flight.number, "name": flight.name, **values}
