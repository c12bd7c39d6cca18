"""The benchmark: fit on the training rows, judge on the test rows, against the truth where there is one."""

from magsim.benchmark.evaluation import evaluate
from magsim.benchmark.judging import NOISE_FLOOR, judge
from magsim.benchmark.methods import ALL
from magsim.benchmark.metrics import METRICS, Metric, scores_of
from magsim.benchmark.report import Report, report_of, rows_of
from magsim.benchmark.residuals import Judged, Residuals, pooled
from magsim.benchmark.rows import Fit, Row

__all__ = [
    "ALL",
    "METRICS",
    "NOISE_FLOOR",
    "Fit",
    "Judged",
    "Metric",
    "Report",
    "Residuals",
    "Row",
    "evaluate",
    "judge",
    "pooled",
    "report_of",
    "rows_of",
    "scores_of",
]
