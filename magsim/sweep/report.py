"""What a sweep has flown, in figures: read from its journal, one file at a time."""

import csv
import json
import re
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from magsim.dataset.parquet import FIGURE
from magsim.storage import atomic_text, atomic_write
from magsim.sweep.journal import Journal, ShardRecord
from magsim.sweep.plan import SweepPlan

FAILURES = "failures.csv"
"""Flights that could not be flown, with reason and settings."""

REPORT = "report.json"
"""Figures of the whole sweep."""

SHOWN_REASONS = 5

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.e+-]*(?!\w)")

_FIGURE = FIGURE.format(sensor="")


def records(plan: SweepPlan, journal: Journal) -> Iterator[ShardRecord]:
    """Yield the records of the finished files of a sweep, in order."""
    for shard in journal.shards():
        record = journal.read(shard) if shard < plan.shards else None
        if record is not None and record.last_place == plan.last_place(shard):
            yield record


@dataclass
class Tally:
    """Figures that are gathered from records.

    Attributes
    ----------
    flown, rows, size : int
    flown_s : float [s]
    kinds : Counter of str
        Failures by kind.
    reasons : Counter of (str, str)
        Failures by kind and reason, its numbers left out.
    spreads : dict of str to array of float
        Values of all flights by figure.
    """

    flown: int = 0
    rows: int = 0
    size: int = 0
    flown_s: float = 0.0
    kinds: Counter[str] = field(default_factory=Counter)
    reasons: Counter[tuple[str, str]] = field(default_factory=Counter)
    spreads: "dict[str, array[float]]" = field(default_factory=dict)

    def add(self, record: ShardRecord) -> None:
        """Add a record."""
        self.size += record.size
        for flight in record.flown:
            self.flown += 1
            self.rows += flight.entry.rows
            self.flown_s += flight.duration_s
            self.spreads.setdefault("duration_s", array("d")).append(flight.duration_s)
            for sensor, std_nt in flight.interference_std_nt.items():
                self.spreads.setdefault(f"{_FIGURE}{sensor}", array("d")).append(std_nt)
        for failed in record.failed:
            self.kinds[failed.kind] += 1
            self.reasons[failed.kind, _NUMBER.sub("#", failed.reason)] += 1

    @property
    def sensors(self) -> list[str]:
        """Scalar magnetometers of all flights."""
        return [name.removeprefix(_FIGURE) for name in self.spreads if name.startswith(_FIGURE)]

    @property
    def failed(self) -> int:
        """Failed flights."""
        return sum(self.kinds.values())

    def to_table(self) -> dict[str, object]:
        """Return the figures as plain types."""
        return {
            "flights": self.flown + self.failed,
            "flown": self.flown,
            "failed": self.failed,
            "hours": self.flown_s / 3600.0,
            "rows": self.rows,
            "bytes": self.size,
            "failures_by_kind": dict(sorted(self.kinds.items())),
            "failures_by_reason": [
                {"kind": kind, "reason": reason, "flights": count}
                for (kind, reason), count in sorted(self.reasons.items(), key=lambda item: (-item[1], item[0]))[:20]
            ],
            "spread": {name: spread(values) for name, values in self.spreads.items()},
        }

    def to_text(self) -> str:
        """Return the figures for people."""
        lines = [
            f"flights     {self.flown} flown, {self.failed} failed",
            f"flown       {self.flown_s / 3600.0:.2f} h, {self.rows} rows, {self.size / 1e9:.3f} GB",
        ]
        for (kind, reason), count in self.reasons.most_common(SHOWN_REASONS):
            lines.append(f"{kind:<11} {count} x {reason[:160]}")
        for name, values in self.spreads.items():
            five = spread(values)
            lines.append(f"{name}: " + ", ".join(f"{label} {value:.4g}" for label, value in five.items()))
        return "\n".join(lines)


def spread(values: Sequence[float]) -> dict[str, float]:
    """Return smallest and largest value, and the 5th, 50th and 95th percentile."""
    labels = ("min", "p5", "median", "p95", "max")
    return dict(zip(labels, np.percentile(np.asarray(values), (0, 5, 50, 95, 100)).tolist(), strict=True))


def write_failures(plan: SweepPlan, journal: Journal) -> None:
    """Write every flight that has failed so far, with its reason and its settings."""
    names = list(plan.space.names)

    def write(temporary: Path) -> None:
        with temporary.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["flight", "name", "kind", "reason", *names, "overrides"])
            for record in records(plan, journal):
                flights = plan.flights_by_number(record.shard) if record.failed else {}
                for failed in record.failed:
                    flight = flights[failed.number]
                    values = [plain(flight.values[name]) for name in names]
                    overrides = " ".join(plan.overrides(flight))
                    table.writerow([failed.number, flight.name, failed.kind, failed.reason, *values, overrides])

    atomic_write(journal.folder / FAILURES, write, force=True)


def plain(value: object) -> object:
    """Return a value as a table for other programs takes it: a list or a table as JSON, a date in ISO 8601."""
    if isinstance(value, list | tuple | Mapping):
        return json.dumps(value, default=str, sort_keys=True)
    isoformat = getattr(value, "isoformat", None)
    return isoformat() if callable(isoformat) else value


def write_report(tally: Tally, path: Path) -> None:
    """Write the figures."""
    text = json.dumps(tally.to_table(), indent=1) + "\n"
    atomic_text(path, text, force=True)
