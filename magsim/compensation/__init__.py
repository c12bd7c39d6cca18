"""Compensators: what learns an aircraft's interference and predicts it from other instruments."""

from magsim.compensation.base import Compensator
from magsim.compensation.registry import create, load, names, parse_method, register
from magsim.compensation.tolles_lawson import TollesLawson, TollesLawsonReport

__all__ = ["Compensator", "TollesLawson", "TollesLawsonReport", "create", "load", "names", "parse_method", "register"]
