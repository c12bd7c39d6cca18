"""Compensators: what learns an aircraft's interference and estimates it from other instruments."""

from magsim.compensation.base import Compensator, FitContext
from magsim.compensation.registry import create, load, make, names, parse_method, register
from magsim.compensation.saving import State
from magsim.compensation.tolles_lawson import TollesLawson, TollesLawsonReport

__all__ = [
    "Compensator",
    "FitContext",
    "State",
    "TollesLawson",
    "TollesLawsonReport",
    "create",
    "load",
    "make",
    "names",
    "parse_method",
    "register",
]
