"""Column sets: what a method reads of a recording, as columns side by side."""

from magsim.compensation.columns.attitude import (
    AngleColumns,
    AttitudeColumns,
    AttitudeRateColumns,
    CoupledColumns,
    GyroColumns,
)
from magsim.compensation.columns.auxiliary import AuxiliaryColumns, ChannelValues, means_of
from magsim.compensation.columns.base import ColumnSet, Design, Joined, require
from magsim.compensation.columns.channels import ChannelColumns
from magsim.compensation.columns.direction import Derivative, VectorField, mean_length, mean_strength, pick_fluxgate
from magsim.compensation.columns.place import HeightColumns, PlaceColumns, TimeColumns, TravelColumns
from magsim.compensation.columns.points import ChangeColumns, PointColumns
from magsim.compensation.columns.position import PositionColumns, position_columns
from magsim.compensation.columns.tolles_lawson import Eddy, Terms, TollesLawsonColumns, tolles_lawson_columns

__all__ = [
    "AngleColumns",
    "AttitudeColumns",
    "AttitudeRateColumns",
    "AuxiliaryColumns",
    "ChangeColumns",
    "ChannelColumns",
    "ChannelValues",
    "ColumnSet",
    "CoupledColumns",
    "Derivative",
    "Design",
    "Eddy",
    "GyroColumns",
    "HeightColumns",
    "Joined",
    "PlaceColumns",
    "PointColumns",
    "PositionColumns",
    "Terms",
    "TimeColumns",
    "TollesLawsonColumns",
    "TravelColumns",
    "VectorField",
    "mean_length",
    "mean_strength",
    "means_of",
    "pick_fluxgate",
    "position_columns",
    "require",
    "tolles_lawson_columns",
]
