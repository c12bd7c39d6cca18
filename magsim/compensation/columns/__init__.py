"""Column sets: what a method reads of a recording, as columns side by side."""

from magsim.compensation.columns.attitude import AttitudeColumns
from magsim.compensation.columns.base import ColumnSet, Design, Joined, require
from magsim.compensation.columns.direction import Derivative, mean_strength, pick_fluxgate
from magsim.compensation.columns.position import PositionColumns, position_columns
from magsim.compensation.columns.tolles_lawson import Terms, TollesLawsonColumns, tolles_lawson_columns

__all__ = [
    "AttitudeColumns",
    "ColumnSet",
    "Derivative",
    "Design",
    "Joined",
    "PositionColumns",
    "Terms",
    "TollesLawsonColumns",
    "mean_strength",
    "pick_fluxgate",
    "position_columns",
    "require",
    "tolles_lawson_columns",
]
