"""The ground: its height above the sea and above the ellipsoid, with its slope, at any place.

A surface gives heights above mean sea level; ``Ground`` adds the height of the geoid, so that all other code uses
heights above the ellipsoid. Surfaces are smooth and have exact gradients.
"""

from magsim.terrain.fractal import Fractal
from magsim.terrain.grid import Grid, read_grid
from magsim.terrain.ground import Flat, Ground, TerrainSurface
from magsim.terrain.plane import TangentPlane

__all__ = ["Flat", "Fractal", "Grid", "Ground", "TangentPlane", "TerrainSurface", "read_grid"]
