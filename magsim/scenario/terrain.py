"""The ground under a flight."""

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Discriminator, Field, ValidationInfo, field_validator

from magsim.config import Strict
from magsim.errors import RequestError
from magsim.scenario.base import Positive
from magsim.scenario.start import Start
from magsim.streams import stream
from magsim.terrain import Flat, Fractal, Grid, Ground, TangentPlane, read_grid

Height = Annotated[float, Field(ge=-500.0, le=9000.0)]


class TerrainBase(Strict):
    """Keys that every ground has."""

    geoid_m: float = Field(
        default=0.0, ge=-120.0, le=100.0, description="mean sea level above the WGS-84 ellipsoid, here"
    )


class FlatTerrain(TerrainBase):
    """The same height everywhere."""

    kind: Literal["flat"] = "flat"
    height_m: Height = Field(default=0.0, description="above mean sea level")


class FractalTerrain(TerrainBase):
    """Random ground with the power-law spectrum of real ground."""

    kind: Literal["fractal"] = "fractal"
    mean_m: Height = Field(default=500.0, description="mean height above mean sea level")
    relief_m: Positive = Field(default=200.0, le=4000.0, description="four standard deviations of the height")
    longest_m: float = Field(default=10_000.0, ge=500.0, le=200_000.0, description="longest wavelength")
    shortest_m: float = Field(default=300.0, ge=20.0, le=50_000.0, description="shortest wavelength")
    hurst: float = Field(default=0.8, ge=0.0, le=1.5, description="0 rough, 1 smooth: amplitude ~ wavelength^hurst")
    seed: int | None = Field(
        default=None, ge=0, lt=2**63, description="of the ground alone; without it the scenario's seed"
    )

    @field_validator("shortest_m")
    @classmethod
    def _shorter(cls, value: float, info: ValidationInfo) -> float:
        longest = info.data.get("longest_m")
        if longest is not None and value >= longest:
            msg = f"{value:g} is not below longest_m = {longest:g}; allowed: 20 to below that"
            raise ValueError(msg)
        return value


class GridTerrain(TerrainBase):
    """A grid of heights from a file."""

    kind: Literal["grid"] = "grid"
    file: str = Field(min_length=1, description="ESRI ASCII grid, heights above mean sea level; beside the scenario")
    coordinates: Literal["geographic", "local"] = Field(
        default="geographic", description="degrees of longitude and latitude, or meters east and north of the start"
    )
    nodata_m: Height | None = Field(default=None, description="height of points without data")


Terrain = Annotated[FlatTerrain | FractalTerrain | GridTerrain, Discriminator("kind")]


def ground_of(terrain: Terrain | None, start: Start, seed: int, folder: Path | None) -> Ground | None:
    """Return the ground that the settings describe.

    Parameters
    ----------
    terrain : FlatTerrain, FractalTerrain or GridTerrain, optional
    start : Start
        Origin of local meters.
    seed : int
        Of the scenario.
    folder : Path, optional
        Where the scenario's files lie; without it they cannot be read.

    Returns
    -------
    Ground or None
        None without settings.

    Raises
    ------
    RequestError
        If a grid cannot be read.
    """
    if terrain is None:
        return None
    plane = TangentPlane(math.radians(start.lat_deg), math.radians(start.lon_deg))
    if isinstance(terrain, FlatTerrain):
        return Ground(Flat(terrain.height_m), terrain.geoid_m)
    if isinstance(terrain, FractalTerrain):
        random = stream(seed if terrain.seed is None else terrain.seed, "terrain/fractal")
        surface = Fractal(
            plane,
            random,
            mean_m=terrain.mean_m,
            relief_m=terrain.relief_m,
            longest_m=terrain.longest_m,
            shortest_m=terrain.shortest_m,
            hurst=terrain.hurst,
        )
        return Ground(surface, terrain.geoid_m)
    if folder is None:
        msg = f"terrain.file: {terrain.file} can be read only where the scenario is a file"
        raise RequestError(msg)
    local = plane if terrain.coordinates == "local" else None
    grid: Grid = read_grid(folder / terrain.file, plane=local, nodata_m=terrain.nodata_m)
    return Ground(grid, terrain.geoid_m)
