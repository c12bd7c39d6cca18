"""Checks that a method of anybody's keeps what a compensator promises."""

from magsim.compensation.checking.flight import check_flight
from magsim.compensation.checking.report import Check, CheckReport
from magsim.compensation.checking.run import check_compensator

__all__ = ["Check", "CheckReport", "check_compensator", "check_flight"]
