"""Sweeps: one scenario in thousands of variations, flown by processes that may die, into a folder of recordings."""

from magsim.sweep.finish import SweepOutcome, check_ready, finish
from magsim.sweep.flying import fly
from magsim.sweep.folder import open_folder
from magsim.sweep.plan import SweepFile, SweepPlan, plan_of, read_sweep
from magsim.sweep.rehearsal import MOST_EXPANDED, check, measure, ranges
from magsim.sweep.run import SweepProgress, run
from magsim.sweep.words import duration
from magsim.sweep.workers import ClusterWorkers, LocalWorkers, Workers, cluster_workers

__all__ = [
    "MOST_EXPANDED",
    "ClusterWorkers",
    "LocalWorkers",
    "SweepFile",
    "SweepOutcome",
    "SweepPlan",
    "SweepProgress",
    "Workers",
    "check",
    "check_ready",
    "cluster_workers",
    "duration",
    "finish",
    "fly",
    "measure",
    "open_folder",
    "plan_of",
    "ranges",
    "read_sweep",
    "run",
]
