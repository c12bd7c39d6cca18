"""Compensators: what learns an aircraft's interference and estimates it from other instruments."""

from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.checking import CheckReport, check_compensator
from magsim.compensation.registry import create, load, make, names, parse_method, presets_of, register
from magsim.compensation.saving import State
from magsim.compensation.tolles_lawson import TollesLawson, TollesLawsonReport

__all__ = [
    "CheckReport",
    "Compensator",
    "FitContext",
    "State",
    "TollesLawson",
    "TollesLawsonReport",
    "check_compensator",
    "create",
    "load",
    "make",
    "names",
    "parse_method",
    "presets_of",
    "register",
]
