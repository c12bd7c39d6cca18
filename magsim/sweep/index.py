"""The index of a sweep: one row for each flight, with every value that varies, what became of it, and where it lies."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from magsim.storage import atomic_write
from magsim.sweep.journal import Journal, ShardRecord, file_name
from magsim.sweep.plan import SweepPlan
from magsim.sweep.report import plain, records
from magsim.sweep.space import SweptFlight

if TYPE_CHECKING:
    import pyarrow as pa

INDEX = "index.parquet"

ROWS_IN_GROUP = 10_000
"""Of the file: a filter reads whole groups."""

STD = "interference_std_nt"
"""Beginning of the names of columns: standard deviation of the interference at a sensor."""


def write_index(plan: SweepPlan, journal: Journal, path: Path) -> None:
    """Write the index of the finished files of a sweep.

    Row groups are written as they fill, so that the number of flights needs no memory.
    """
    import pyarrow as pa
    from pyarrow import parquet

    schema = _schema(plan)

    def write(temporary: Path) -> None:
        with parquet.ParquetWriter(temporary, schema) as writer:
            rows: list[dict[str, object]] = []
            for record in records(plan, journal):
                rows += _rows(plan, record, schema)
                while len(rows) >= ROWS_IN_GROUP:
                    writer.write_table(pa.Table.from_pylist(rows[:ROWS_IN_GROUP], schema))
                    rows = rows[ROWS_IN_GROUP:]
            writer.write_table(pa.Table.from_pylist(rows, schema))

    atomic_write(path, write, force=True)


def _schema(plan: SweepPlan) -> "pa.Schema":
    import pyarrow as pa

    fixed = {
        "flight": pa.int64(),
        "name": pa.string(),
        "flown": pa.bool_(),
        "failure": pa.string(),
        "file": pa.string(),
        "number": pa.int32(),
        "rows": pa.int32(),
        "train_rows": pa.int32(),
        "valid_rows": pa.int32(),
        "test_rows": pa.int32(),
        "duration_s": pa.float64(),
        "digest": pa.string(),
        "seed": pa.int64(),
        "sha256": pa.string(),
    }
    swept = {name: _type(values) for name, values in plan.space.examples().items()}
    figures = {f"{STD}.{sensor.name}": pa.float64() for sensor in plan.base.scenario.sensors.scalar}
    return pa.schema(list((fixed | swept | figures).items()))


def _type(values: Sequence[object]) -> "pa.DataType":
    """Return the type of a column that holds such values."""
    import pyarrow as pa

    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return pa.bool_()
    if kinds == {int}:
        return pa.int64()
    if kinds <= {int, float}:
        return pa.float64()
    if kinds == {datetime} and all(value.tzinfo is not None for value in values):  # type: ignore[attr-defined]
        return pa.timestamp("us", "UTC")
    return pa.string()


def _rows(plan: SweepPlan, record: ShardRecord, schema: "pa.Schema") -> Iterator[dict[str, object]]:
    """Yield the rows of a finished file: first the flights in it, in order, then those that failed."""
    flights = plan.flights_by_number(record.shard)
    for number, flown in enumerate(record.flown):
        entry = flown.entry
        yield {
            **_row(flights[flown.number], schema),
            "flown": True,
            "file": file_name(record.shard),
            "number": number,
            "rows": entry.rows,
            **{f"{split}_rows": entry.splits.get(split, 0) for split in ("train", "valid", "test")},
            "duration_s": flown.duration_s,
            "digest": entry.digest,
            "seed": flown.seed,
            "sha256": record.sha256,
            **{f"{STD}.{sensor}": std_nt for sensor, std_nt in flown.interference_std_nt.items()},
        }
    for failed in record.failed:
        yield {**_row(flights[failed.number], schema), "flown": False, "failure": failed.reason, "number": -1}


def _row(flight: SweptFlight, schema: "pa.Schema") -> dict[str, object]:
    """Return what a flight's row has whatever became of it."""
    import pyarrow as pa

    row: dict[str, object] = {"flight": flight.number, "name": flight.name}
    for name, value in flight.values.items():
        kind = schema.field(name).type
        text = pa.types.is_string(kind) and not isinstance(value, str)
        row[name] = str(plain(value)) if text else value
    return row
