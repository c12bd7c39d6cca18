"""Meshes that only tests need."""

import numpy as np

from magsim.field.geometry.meshes import Tetrahedra, extrude, icosphere


def shell_solid(subdivisions: int, inner: float, outer: float, layers: int = 1) -> Tetrahedra:
    """Return a thick spherical shell; each spherical section is scaled to its exact volume."""
    shell = icosphere(subdivisions, 1.0, keep="volume")
    radii = np.linspace(inner, outer, layers + 1)
    return extrude(np.stack([shell.vertices * radius for radius in radii]), shell.triangles)
