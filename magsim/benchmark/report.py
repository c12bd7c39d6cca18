"""The result of a benchmark: a tidy table with its text and JSON forms."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from magsim.config.schema import did_you_mean
from magsim.errors import RequestError

if TYPE_CHECKING:
    import pandas as pd

WHOLE = "test"
"""Segment that stands for all test rows of a recording."""

METRICS = {
    "std_nt": "STD of the error in 0.1 to 0.6 Hz",
    "ir": "improvement ratio against truth: in-band STD of the interference over that of the error",
    "rmse_nt": "root of the mean squared error, broadband with offset",
    "rmse0_nt": "the same with the mean removed",
    "fom_nt": "figure of merit: maximum minus minimum of the in-band error of each maneuver, summed over headings",
    "peak_nt": "maximum minus minimum of the in-band error of one maneuver",
    "gain": "share of an injected anomaly that is left: must be within 0.05 of 1",
    "std_paper_nt": "STD of the compensated reading in 0.1 to 0.6 Hz, the papers' STD: clean field counts as error",
    "ir_paper": "the papers' ratio, of the reading over the compensated reading: rewards smooth output",
    "ir_003": "paper 002's ratio, of the reading over the compensated reading, both above 0.03 Hz",
    "fom_paper_nt": "figure of merit of the compensated reading",
    "peak_paper_nt": "maximum minus minimum of the compensated reading in band during one maneuver",
}
"""Metrics in the order of the table, with their meaning."""

SEGMENT_TABLES = {
    "std_nt": "STD in band [nT] by heading (straight legs) and by maneuver",
    "ir": "improvement ratio against truth, in band, by heading (straight legs) and by maneuver",
    "std_paper_nt": "STD of the compensated reading in band [nT] by heading (straight legs) and by maneuver",
    "ir_paper": "the papers' ratio of the reading, in band, by heading (straight legs) and by maneuver",
    "ir_003": "paper 002's ratio of the reading, above 0.03 Hz, by heading (straight legs) and by maneuver",
    "peak_nt": "maximum minus minimum in band [nT] of each maneuver",
    "peak_paper_nt": "maximum minus minimum of the compensated reading in band [nT] of each maneuver",
}
"""Scores that parts of a flight have, with the titles of their tables."""

STANDARD = ("std_nt", "peak_nt")
"""Tables of parts that a report shows unless others are asked for."""

STAND_INS = {"std_nt": "std_paper_nt", "peak_nt": "peak_paper_nt"}
"""What is shown in their place where there is no truth."""

WIDE = 100
"""Width from which on a table of parts is turned round if that makes it narrower."""


def check_scores(scores: Sequence[str]) -> None:
    """Refuse scores that no table of parts has.

    Raises
    ------
    RequestError
        If there is none, or one is unknown; the message lists those that there are.
    """
    allowed = ", ".join(SEGMENT_TABLES)
    if not scores:
        msg = f"no score is named; allowed: {allowed}"
        raise RequestError(msg)
    for score in scores:
        if score not in SEGMENT_TABLES:
            msg = f"there is no table of {score!r}{did_you_mean(score, SEGMENT_TABLES)}; allowed: {allowed}"
            raise RequestError(msg)


class Row(NamedTuple):
    """One value: method x recording x segment x metric.

    ``segment`` is ``test`` for all test rows, else the straight legs of a heading (``heading 90``), a maneuver
    (``roll``), or one maneuver on one heading (``heading 90 roll``).
    """

    method: str
    recording: str
    segment: str
    metric: str
    value: float


@dataclass(frozen=True)
class Report:
    """What a benchmark found.

    Attributes
    ----------
    sensor : str
        The scalar magnetometer that was compensated.
    rows : tuple of Row
        In the order of the methods, then recordings.
    about : mapping
        Version, seed, parameters of the methods, rows that were used.
    notes : tuple of str
        What a reader must know: missing truth, for example.
    fit_s : mapping of str to float [s]
        CPU time of each fit. Not part of the JSON, since it differs from run to run.
    """

    sensor: str
    rows: tuple[Row, ...]
    about: Mapping[str, object] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    fit_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the rows of the table, in order."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings that were judged."""
        return tuple(dict.fromkeys(row.recording for row in self.rows))

    def value(self, method: str, metric: str, *, recording: str | None = None, segment: str = WHOLE) -> float:
        """One value; of the first recording if none is named.

        Raises
        ------
        KeyError
            If the report does not hold it.
        """
        wanted = (method, recording or self.recordings[0], segment, metric)
        for row in self.rows:
            if row[:4] == wanted:
                return row.value
        msg = f"the report holds no {' / '.join(wanted)}"
        raise KeyError(msg)

    def to_frame(self) -> "pd.DataFrame":
        """Tidy table: one line for each value, with the columns of ``Row``."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=Row._fields)

    def summary(self, segment: str = WHOLE) -> "pd.DataFrame":
        """Wide table: one line for each method and recording, one column for each metric."""
        frame = self.to_frame()
        frame = frame[frame["segment"] == segment]
        wide = frame.pivot_table(
            index=["recording", "method"], columns="metric", values="value", sort=False, dropna=False
        )
        return wide[[metric for metric in METRICS if metric in wide]]

    def to_json(self) -> str:
        """The report as JSON: the same bytes for the same data. Values that are not finite are null."""
        table = [{**row._asdict(), "value": row.value if math.isfinite(row.value) else None} for row in self.rows]
        whole = {"sensor": self.sensor, "about": dict(self.about), "notes": list(self.notes), "rows": table}
        return json.dumps(whole, indent=1, sort_keys=True, allow_nan=False) + "\n"

    def to_text(self, *, times: bool = True, scores: Sequence[str] | None = None) -> str:
        """Tables for people: all test rows, then by heading and by maneuver.

        Parameters
        ----------
        times : bool
            Add the column of fit times, which differs from run to run.
        scores : sequence of str, optional
            Scores with a table by heading and by maneuver, of ``SEGMENT_TABLES``; by default ``STANDARD``.

        Raises
        ------
        RequestError
            If there is no table of a score.
        """
        check_scores(STANDARD if scores is None else scores)
        blocks = []
        for recording in self.recordings:
            title = f"{recording}, sensor {self.sensor}"
            blocks += [title, self._whole_table(recording, times=times), ""]
            for score in STANDARD if scores is None else dict.fromkeys(scores):
                table = self._segment_table(recording, score)
                if table:
                    blocks += [table, ""]
                elif scores is not None:
                    blocks += [f"{SEGMENT_TABLES[score]}: none, {recording} has no {score} of parts", ""]
        blocks += [f"note: {note}" for note in self.notes]
        return "\n".join(blocks).rstrip("\n") + "\n"

    def _whole_table(self, recording: str, *, times: bool) -> str:
        cells = {(r.method, r.metric): r.value for r in self.rows if r.recording == recording and r.segment == WHOLE}
        metrics = [metric for metric in METRICS if any(key[1] == metric for key in cells)]
        header = ["method", *metrics] + (["fit_s"] if times else [])
        lines = []
        for method in self.methods:
            line = [method, *(_show(cells.get((method, metric)), metric) for metric in metrics)]
            if times:
                line.append(f"{self.fit_s[method]:.2f}" if method in self.fit_s else "-")
            lines.append(line)
        return _align(header, lines)

    def _segment_table(self, recording: str, score: str) -> str:
        """Parts of the flight by method in a score or its stand-in, with its title; wide tables are turned round."""
        found = [r for r in self.rows if r.recording == recording and r.segment != WHOLE]
        metric = score if any(r.metric == score for r in found) else STAND_INS.get(score)
        cells = {(r.segment, r.method): r.value for r in found if r.metric == metric}
        if metric is None or not cells:
            return ""
        parts = list(dict.fromkeys(part for part, _ in cells))
        by_part = [[p, *(_show(cells.get((p, m)), metric) for m in self.methods)] for p in parts]
        by_method = [[m, *(_show(cells.get((p, m)), metric) for p in parts)] for m in self.methods]
        tables = [_align(["segment", *self.methods], by_part), _align(["method", *parts], by_method)]
        # the line below the header has the full width
        widths = [len(table.splitlines()[1]) for table in tables]
        turned = widths[0] > WIDE and widths[1] < widths[0]
        return f"{SEGMENT_TABLES[metric]}\n{tables[turned]}"


def _show(value: float | None, metric: str) -> str:
    if value is None or math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf"
    if metric.startswith("ir"):
        return f"{value:.2f}" if value < 10.0 else f"{value:.1f}"
    return f"{value:.3f}" if metric == "gain" else f"{value:.4f}"


def _align(header: list[str], lines: list[list[str]]) -> str:
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
