"""Conducting skins: the mesh of an aircraft, thin shells with their eddy currents, and the skin of one aircraft."""

from magsim.field.metal.skin.mesh import Outline, outline
from magsim.field.metal.skin.model import SkinModel, compute_skin, load_skin

__all__ = [
    "Outline",
    "SkinModel",
    "compute_skin",
    "load_skin",
    "outline",
]
