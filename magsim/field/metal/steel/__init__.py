"""Soft magnetic steel: shapes, the equations of its magnetization, and the steel of one aircraft."""

from magsim.field.metal.steel.induced import InducedModel
from magsim.field.metal.steel.model import SteelModel, compute_steel, load_steel

__all__ = [
    "InducedModel",
    "SteelModel",
    "compute_steel",
    "load_steel",
]
