"""The metrics of the benchmark: one object for each score, and pure functions of residuals.

Tables, JSON, help texts and docs follow from ``METRICS``. A score must be named with its variant: the literature has
several of the same name.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from magsim.benchmark.formulas import (
    anomaly_gain,
    distortion,
    excess_pt,
    figure_of_merit,
    gain_at,
    heading_dc,
    known,
    r_squared,
    ratio,
    rms,
    slow_nt,
    std,
)
from magsim.benchmark.residuals import TWINS, Residuals, Score
from magsim.benchmark.twins import PEAKS_NT
from magsim.config.schema import did_you_mean
from magsim.errors import RequestError

Scope = Literal["test", "segment", "cell"]
"""Rows that a score is defined for: all test rows of a recording; a heading or a maneuver; a maneuver on a heading."""


@dataclass(frozen=True)
class Metric:
    """One score.

    Attributes
    ----------
    name : str
        With its unit as a suffix, if it has one.
    unit : str
        ``nT``, ``pT`` or ``1``.
    meaning : str
        For help texts and docs.
    better : {"less", "more", "one"}
        Which values are good: small, large, or close to 1.
    needs : tuple of str
        Signals of ``Residuals`` that must be known; ``cells`` for maneuvers on headings.
    score : callable
        Pure function of residuals.
    scopes : tuple of str
        See ``Scope``.
    table : str
        Title of its table by heading and maneuver; empty if it has none.
    stands_in_for : str
        Metric in whose place it is shown where there is no truth.
    printed : bool
        The table of a report has a column of it; tidy tables and JSON hold every metric.
    """

    name: str
    unit: str
    meaning: str
    better: Literal["less", "more", "one"]
    needs: tuple[str, ...]
    score: Score
    scopes: tuple[Scope, ...]
    table: str = ""
    stands_in_for: str = ""
    printed: bool = True

    def of(self, residuals: Residuals) -> float | None:
        """Return the score, or None where the residuals lack what it needs."""
        return self.score(residuals) if all(residuals.has(name) for name in self.needs) else None

    def show(self, value: float | None) -> str:
        """Return a value as text for a table."""
        if value is None or np.isnan(value):
            return "-"
        if np.isinf(value):
            return "inf"
        if self.better == "more":
            return f"{value:.2f}" if value < 10.0 else f"{value:.1f}"
        return f"{value:.3f}" if self.better == "one" else f"{value:.4f}"


def _gain_at(height: int) -> Score:
    return lambda residuals: gain_at(residuals, height)


_PARTS: tuple[Scope, ...] = ("test", "segment")
_BY = "by heading (straight legs) and by maneuver"

METRICS: tuple[Metric, ...] = (
    Metric(
        "std_nt",
        "nT",
        "STD of the error in 0.1 to 0.6 Hz",
        "less",
        ("error",),
        lambda r: std(known(r.error)),
        _PARTS,
        f"STD in band [nT] {_BY}",
    ),
    Metric(
        "ir",
        "1",
        "improvement ratio against truth: in-band STD of the interference over that of the error (paper 000, eq. 41)",
        "more",
        ("error", "interference"),
        lambda r: ratio(std(known(r.interference)), std(known(r.error))),
        _PARTS,
        f"improvement ratio against truth, in band, {_BY}",
    ),
    Metric(
        "rmse_nt",
        "nT",
        "root of the mean squared error, broadband with offset",
        "less",
        ("error_raw",),
        lambda r: rms(known(r.error_raw)),
        ("test",),
    ),
    Metric(
        "rmse0_nt",
        "nT",
        "the same with the mean removed",
        "less",
        ("error_raw",),
        lambda r: std(known(r.error_raw)),
        ("test",),
    ),
    Metric(
        "fom_nt",
        "nT",
        "figure of merit: maximum minus minimum of the in-band error of each maneuver, summed over headings",
        "less",
        ("error", "cells"),
        lambda r: figure_of_merit(r, known(r.error)),
        ("test",),
    ),
    Metric(
        "peak_nt",
        "nT",
        "maximum minus minimum of the in-band error of one maneuver",
        "less",
        ("error",),
        lambda r: float(np.ptp(known(r.error))),
        ("cell",),
        "maximum minus minimum in band [nT] of each maneuver",
    ),
    Metric(
        "excess_pt",
        "pT",
        "error in band beyond the instrument's own: the root of the difference of the squared STDs",
        "less",
        ("error", "floor"),
        excess_pt,
        ("test",),
    ),
    Metric(
        "slow_nt",
        "nT",
        "STD of the error in 0.005 to 0.1 Hz, without a straight line over each piece of 150 s or more",
        "less",
        ("slow",),
        slow_nt,
        ("test",),
    ),
    Metric(
        "heading_dc_nt",
        "nT",
        "largest minus smallest mean of the error over the headings, straight legs alone",
        "less",
        ("error_raw", "cells"),
        heading_dc,
        ("test",),
        printed=False,
    ),
    Metric(
        "r2",
        "1",
        "1 minus the squared error over the squared interference about its mean, broadband (paper 001)",
        "one",
        ("error_raw", "interference_raw"),
        r_squared,
        ("test",),
        printed=False,
    ),
    Metric(
        "ir_pp",
        "1",
        "peak-to-peak of the interference over that of the error, broadband (paper 003, eqs. 14 and 16)",
        "more",
        ("error_raw", "interference_raw"),
        lambda r: ratio(float(np.ptp(known(r.interference_raw))), float(np.ptp(known(r.error_raw)))),
        ("test",),
        printed=False,
    ),
    Metric(
        "gain",
        "1",
        "share of injected anomalies that is left, at the height where it is farthest from 1: must be within 0.02 of 1",
        "one",
        TWINS,
        anomaly_gain,
        ("test",),
    ),
    *(
        Metric(
            f"gain_{peak:g}",
            "1",
            f"the same of anomalies of {peak:g} nT",
            "one",
            TWINS,
            _gain_at(number),
            ("test",),
            printed=False,
        )
        for number, peak in enumerate(PEAKS_NT)
    ),
    Metric(
        "distortion",
        "1",
        "how far what is left of anomalies departs from a copy of them, over them: must be below 0.1",
        "less",
        TWINS,
        distortion,
        ("test",),
    ),
    Metric(
        "fourth_nt",
        "nT",
        "STD of the fourth difference of the compensated reading, over 16",
        "less",
        ("fourth",),
        lambda r: std(r.fourth),
        ("test",),
        printed=False,
    ),
    Metric(
        "std_paper_nt",
        "nT",
        "STD of the compensated reading in 0.1 to 0.6 Hz, the papers' STD: clean field counts as error",
        "less",
        ("compensated",),
        lambda r: std(r.compensated),
        _PARTS,
        f"STD of the compensated reading in band [nT] {_BY}",
        stands_in_for="std_nt",
    ),
    Metric(
        "ir_paper",
        "1",
        "the papers' ratio, of the reading over the compensated reading: rewards smooth output",
        "more",
        ("reading", "compensated"),
        lambda r: ratio(std(r.reading), std(r.compensated)),
        _PARTS,
        f"the papers' ratio of the reading, in band, {_BY}",
    ),
    Metric(
        "ir_003",
        "1",
        "paper 002's ratio, of the reading over the compensated reading, both above 0.03 Hz (eq. 22)",
        "more",
        ("far",),
        lambda r: ratio(std(r.reading_high[r.far == 1.0]), std(r.compensated_high[r.far == 1.0])),
        _PARTS,
        f"paper 002's ratio of the reading, above 0.03 Hz, {_BY}",
    ),
    Metric(
        "fom_paper_nt",
        "nT",
        "figure of merit of the compensated reading",
        "less",
        ("compensated", "cells"),
        lambda r: figure_of_merit(r, r.compensated),
        ("test",),
    ),
    Metric(
        "peak_paper_nt",
        "nT",
        "maximum minus minimum of the compensated reading in band during one maneuver",
        "less",
        ("compensated",),
        lambda r: float(np.ptp(r.compensated)),
        ("cell",),
        "maximum minus minimum of the compensated reading in band [nT] of each maneuver",
        stands_in_for="peak_nt",
    ),
)
"""All metrics in the order of the table."""

BY_NAME = {metric.name: metric for metric in METRICS}

WITH_TABLE = tuple(metric.name for metric in METRICS if metric.table)
"""Metrics that parts of a flight have, each with a table."""

STANDARD = ("std_nt", "peak_nt")
"""Tables by heading and maneuver that a report shows unless others are asked for."""


def check_scores(scores: Sequence[str]) -> None:
    """Refuse scores that have no table by heading and maneuver.

    Raises
    ------
    RequestError
        If there is none, or one is unknown; the message lists those that there are.
    """
    allowed = ", ".join(WITH_TABLE)
    if not scores:
        msg = f"no score is named; allowed: {allowed}"
        raise RequestError(msg)
    for score in scores:
        if score not in WITH_TABLE:
            msg = f"there is no table of {score!r}{did_you_mean(score, WITH_TABLE)}; allowed: {allowed}"
            raise RequestError(msg)


WHOLE = "test"
"""Segment that stands for all test rows of a recording."""


def scores_of(residuals: Residuals) -> list[tuple[str, str, float]]:
    """Compute every score of residuals.

    Returns
    -------
    list of (segment, metric, value)
        All test rows first, then headings and maneuvers, then maneuvers on headings; without scores that need what
        the residuals lack.
    """
    parts: list[tuple[Scope, str, Residuals]] = [("test", WHOLE, residuals)]
    parts += [("segment", segment.name, residuals.take(segment.rows)) for segment in residuals.segments]
    parts += [("cell", cell.name, residuals.take(cell.rows)) for cell in residuals.cells]
    out = []
    for scope, name, part in parts:
        for metric in METRICS:
            value = metric.of(part) if scope in metric.scopes else None
            if value is not None:
                out.append((name, metric.name, value))
    return out
