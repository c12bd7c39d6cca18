"""Targets: what a method is fitted to, with labels and without."""

from magsim.compensation.targets.base import (
    Label,
    Reading,
    Target,
    interference,
    kept_rows,
    reading,
    reading_rows,
    rows_to_fit,
)
from magsim.compensation.targets.choice import TargetName, target_of
from magsim.compensation.targets.crossings import Crossings
from magsim.compensation.targets.model import KnownField
from magsim.compensation.targets.pairs import Pairs
from magsim.compensation.targets.reference import OtherReading
from magsim.compensation.targets.weighting import weight_of_pairs

__all__ = [
    "Crossings",
    "KnownField",
    "Label",
    "OtherReading",
    "Pairs",
    "Reading",
    "Target",
    "TargetName",
    "interference",
    "kept_rows",
    "reading",
    "reading_rows",
    "rows_to_fit",
    "target_of",
    "weight_of_pairs",
]
