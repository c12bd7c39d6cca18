"""Tolles-Lawson that goes on learning in flight: recursive least squares with bounded memory."""

from magsim.compensation.recursive.adaptation import Adaptation, Known
from magsim.compensation.recursive.method import RecursiveTollesLawson

__all__ = ["Adaptation", "Known", "RecursiveTollesLawson"]
