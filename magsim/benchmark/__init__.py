"""The benchmark: fit on the training rows, judge on the test rows, against the truth where there is one."""

from magsim.benchmark.protocol import benchmark
from magsim.benchmark.report import Report, Row

__all__ = ["Report", "Row", "benchmark"]
