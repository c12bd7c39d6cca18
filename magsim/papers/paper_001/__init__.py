"""Paper 001: a perceptron with skips on one flight of a drone, applied to another."""

from magsim.papers.paper_001.paper import PAPER

__all__ = ["PAPER"]
