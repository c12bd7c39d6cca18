"""The result of a benchmark: a tidy table of scores with its JSON form."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from magsim.benchmark import tables
from magsim.benchmark.metrics import METRICS, STANDARD, WHOLE, scores_of
from magsim.benchmark.residuals import Residuals
from magsim.benchmark.rows import Fit, Row

if TYPE_CHECKING:
    import pandas as pd


def rows_of(residuals: Residuals) -> list[Row]:
    """Return every score of residuals as rows."""
    about = asdict(residuals.judged)
    return [Row(**about, segment=part, metric=metric, value=value) for part, metric, value in scores_of(residuals)]


@dataclass(frozen=True)
class Report:
    """What a benchmark found.

    Attributes
    ----------
    rows : tuple of Row
        In the order of the recordings, then methods.
    fits : tuple of Fit
        What each method was fitted on.
    about : mapping
        Version, bands, parameters of the methods, recordings and groups.
    notes : tuple of str
        What a reader must know: missing truth, for example.
    fit_s : mapping of (method, group) to float [s]
        CPU time of each fit. Not part of the JSON, since it differs from run to run.
    """

    rows: tuple[Row, ...]
    fits: tuple[Fit, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    fit_s: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods, in order."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings that were judged."""
        return tuple(dict.fromkeys(row.recording for row in self.rows))

    def value(
        self, method: str, metric: str, *, recording: str | None = None, file: str | None = None, segment: str = WHOLE
    ) -> float:
        """Return one score; of the first recording if none is named, in the first file that holds it.

        Raises
        ------
        KeyError
            If the report does not hold it.
        """
        name = recording if recording is not None else next(iter(self.recordings), "")
        for row in self.rows:
            named = row.recording == name and file in (None, row.file)
            if named and (row.method, row.segment, row.metric) == (method, segment, metric):
                return row.value
        msg = f"the report holds no {method} / {name} / {segment} / {metric}"
        raise KeyError(msg)

    def to_frame(self) -> "pd.DataFrame":
        """Return a tidy table: one line for each score, with the columns of ``Row``."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=list(Row._fields)).astype({"level": "Int64"})

    def summary(self, segment: str = WHOLE) -> "pd.DataFrame":
        """Return a wide table: one line for each recording and method, one column for each metric."""
        import pandas as pd

        lines: dict[tuple[str, str, str], dict[str, float]] = {}
        for row in self.rows:
            if row.segment == segment:
                lines.setdefault((row.recording, row.file, row.method), {})[row.metric] = row.value
        names = [metric.name for metric in METRICS if any(metric.name in line for line in lines.values())]
        index = pd.MultiIndex.from_tuples(list(lines), names=["recording", "file", "method"])
        return pd.DataFrame([[line.get(name) for name in names] for line in lines.values()], index, names, dtype=float)

    def to_json(self) -> str:
        """Return the report as JSON: the same bytes for the same data. Values that are not finite are null."""
        rows = [{**row._asdict(), "value": row.value if math.isfinite(row.value) else None} for row in self.rows]
        fits = [fit._asdict() for fit in self.fits]
        whole = {"about": dict(self.about), "fits": fits, "notes": list(self.notes), "rows": rows}
        return json.dumps(whole, indent=1, sort_keys=True, allow_nan=False) + "\n"

    def to_text(self, *, times: bool = True, scores: Sequence[str] | None = None) -> str:
        """Return tables for people: all test rows of each recording, then by heading and by maneuver.

        Parameters
        ----------
        times : bool
            Add the column of fit times, which differs from run to run.
        scores : sequence of str, optional
            Metrics with a table by heading and by maneuver; by default ``metrics.STANDARD``.

        Raises
        ------
        RequestError
            If there is no table of a metric.
        """
        chosen = STANDARD if scores is None else scores
        fit_s = self._fit_seconds() if times else None
        text = tables.text(self.rows, chosen, fit_s=fit_s, asked=scores is not None)
        lines = tables.fitted(self.fits) + [f"note: {note}" for note in self.notes]
        return text.rstrip("\n") + "\n" + "".join(f"{line}\n" for line in ["", *lines] if lines)

    def _fit_seconds(self) -> dict[tuple[str, str], str]:
        """Return the CPU time of the fit that each recording was judged with, as text, by method and recording."""
        groups: Mapping[str, Sequence[str]] = self.about.get("groups", {})
        given = {fit.method: "given" for fit in self.fits if fit.given}
        out = {(method, recording): text for method, text in given.items() for recording in self.recordings}
        for (method, group), seconds in self.fit_s.items():
            out |= {(method, recording): f"{seconds:.2f}" for recording in groups.get(group, ())}
        return out

    def __repr__(self) -> str:
        return f"<Report: {len(self.methods)} methods on {len(self.recordings)} recordings, {len(self.rows)} scores>"

    def __str__(self) -> str:
        return self.to_text()

    def _repr_html_(self) -> str:
        return str(self.summary().to_html(float_format=lambda value: f"{value:.4g}"))


def report_of(residuals: Iterable[Residuals]) -> Report:
    """Return the scores of residuals that were kept, as a report without fits."""
    return Report(tuple(row for one in residuals for row in rows_of(one)))
