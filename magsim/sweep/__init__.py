"""Sweeps: one scenario in thousands of variations, flown by processes that may die, into a folder of recordings."""

from magsim.sweep.crews import ClusterCrew, Crew, LocalCrew, cluster_crew
from magsim.sweep.finish import SweepOutcome, check_ready, finish, write_failures
from magsim.sweep.folder import SweepFolder, open_folder
from magsim.sweep.plan import SweepFile, SweepPlan, plan_of, read_sweep
from magsim.sweep.rehearsal import check, measure, ranges
from magsim.sweep.run import SweepProgress, run
from magsim.sweep.words import duration

__all__ = [
    "ClusterCrew",
    "Crew",
    "LocalCrew",
    "SweepFile",
    "SweepFolder",
    "SweepOutcome",
    "SweepPlan",
    "SweepProgress",
    "check",
    "check_ready",
    "cluster_crew",
    "duration",
    "finish",
    "measure",
    "open_folder",
    "plan_of",
    "ranges",
    "read_sweep",
    "run",
    "write_failures",
]
