"""Triangles and tetrahedra: meshes, mesh files, refinement, soundness, and potential integrals over panels."""

from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh
from magsim.field.geometry.meshfile import read_surface
from magsim.field.geometry.panels import Panels
from magsim.field.geometry.soundness import check_surface, winding

__all__ = [
    "Panels",
    "Tetrahedra",
    "TriangleMesh",
    "check_surface",
    "read_surface",
    "winding",
]
