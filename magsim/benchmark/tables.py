"""A report as tables of plain text."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from magsim.benchmark.metrics import BY_NAME, METRICS, WHOLE, check_scores
from magsim.benchmark.rows import Fit, Row

WIDE = 100
"""Width from which on a table of parts is transposed if that makes it narrower."""


class Subject(NamedTuple):
    """What a table is about: one recording in one file."""

    recording: str
    file: str
    sensor: str
    level: int | None

    @classmethod
    def of(cls, row: Row) -> "Subject":
        """Return the subject of a row."""
        return cls(row.recording, row.file, row.sensor, row.level)

    def __str__(self) -> str:
        file = f" ({self.file})" if self.file and self.file.removesuffix(".h5") != self.recording else ""
        level = "" if self.level is None else f", level {self.level}"
        return f"{self.recording}{file}, sensor {self.sensor}{level}"


def text(
    rows: Sequence[Row], scores: Sequence[str], *, fit_s: Mapping[tuple[str, str], str] | None, asked: bool
) -> str:
    """Return the tables of a report's rows; see ``Report.to_text``.

    Parameters
    ----------
    rows : sequence of Row
    scores : sequence of str
        Metrics with a table by heading and by maneuver.
    fit_s : mapping of (method, recording) to str, optional
        Times of the fits, as text; without it, there is no such column.
    asked : bool
        The metrics were asked for, so that one without values is reported as such.

    Raises
    ------
    RequestError
        If there is no table of a metric.
    """
    check_scores(scores)
    blocks = []
    of: dict[Subject, list[Row]] = {}
    for row in rows:
        of.setdefault(Subject.of(row), []).append(row)
    for subject, own in of.items():
        blocks += [str(subject), _whole(own, fit_s), ""]
        for score in dict.fromkeys(scores):
            table = _parts(own, score)
            if table:
                blocks += [table, ""]
            elif asked:
                blocks += [f"{BY_NAME[score].table}: none, {subject.recording} has no {score} of parts", ""]
    return "\n".join(blocks) + "\n" if blocks else ""


def fitted(fits: Sequence[Fit]) -> list[str]:
    """Return lines about what methods were fitted on, one for each set of training rows."""
    methods: dict[Fit, list[str]] = {}
    for fit in fits:
        methods.setdefault(fit._replace(method=""), []).append(fit.method)
    lines = []
    for fit, names in methods.items():
        listed = ", ".join(names)
        if fit.given:
            lines.append(f"given as fitted: {listed}")
        else:
            valid = f" and {fit.valid} validation" if fit.valid else ""
            lines.append(f"fitted on {fit.train} training{valid} rows of {', '.join(fit.recordings)}: {listed}")
    return lines


def _whole(rows: Sequence[Row], fit_s: Mapping[tuple[str, str], str] | None) -> str:
    """Return the table of all test rows: a line for each method."""
    cells = {(row.method, row.metric): row.value for row in rows if row.segment == WHOLE}
    found = {name for _, name in cells}
    metrics = [metric for metric in METRICS if metric.printed and metric.name in found]
    header = ["method", *(metric.name for metric in metrics)] + ([] if fit_s is None else ["fit_s"])
    lines = []
    for method in dict.fromkeys(row.method for row in rows):
        line = [method, *(metric.show(cells.get((method, metric.name))) for metric in metrics)]
        lines.append(line + ([] if fit_s is None else [fit_s.get((method, rows[0].recording), "-")]))
    return aligned(header, lines)


def _parts(rows: Iterable[Row], score: str) -> str:
    """Return the table of a metric by parts of the flight, with its title; wide tables are transposed.

    Where there is no truth, the metric that stands in for it is shown.
    """
    found = [row for row in rows if row.segment != WHOLE]
    stand_in = next((metric.name for metric in METRICS if metric.stands_in_for == score), score)
    name = score if any(row.metric == score for row in found) else stand_in
    cells = {(row.segment, row.method): row.value for row in found if row.metric == name}
    if not cells:
        return ""
    metric = BY_NAME[name]
    parts, methods = (list(dict.fromkeys(key[i] for key in cells)) for i in (0, 1))
    by_part = [[p, *(metric.show(cells.get((p, m))) for m in methods)] for p in parts]
    by_method = [[m, *(metric.show(cells.get((p, m))) for p in parts)] for m in methods]
    tables = [aligned(["segment", *methods], by_part), aligned(["method", *parts], by_method)]
    # the line below the header has the full width
    widths = [len(table.splitlines()[1]) for table in tables]
    transposed = widths[0] > WIDE and widths[1] < widths[0]
    return f"{metric.table}\n{tables[transposed]}"


def aligned(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return a table with a rule under its header; the first column is left-aligned."""
    table = [header, *lines]
    widths = [max(len(line[i]) for line in table) for i in range(len(header))]
    rows = [
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in table
    ]
    rows.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(row.rstrip() for row in rows)
