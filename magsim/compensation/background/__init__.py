"""The field without the platform, in body axes, as far as inputs tell it."""

from magsim.compensation.background.calibrated import CalibratedField, Readings, Regressors
from magsim.compensation.background.calibration import calibrate
from magsim.compensation.background.channels import Channel, live_channels, of_kinds
from magsim.compensation.background.choice import (
    FLUXGATE_SEES,
    LOOKAHEAD_ROWS,
    BackgroundField,
    Direction,
    FluxgateField,
    background_from,
    fit_background,
)
from magsim.compensation.background.model import READS as MODEL_READS
from magsim.compensation.background.model import ModelField, model_along
from magsim.compensation.background.taps import taps

__all__ = [
    "FLUXGATE_SEES",
    "LOOKAHEAD_ROWS",
    "MODEL_READS",
    "BackgroundField",
    "CalibratedField",
    "Channel",
    "Direction",
    "FluxgateField",
    "ModelField",
    "Readings",
    "Regressors",
    "background_from",
    "calibrate",
    "fit_background",
    "live_channels",
    "model_along",
    "of_kinds",
    "taps",
]
