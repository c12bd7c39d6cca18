"""A surface above the sea, and the ground above the ellipsoid: the surface plus the geoid."""

import hashlib
from dataclasses import dataclass
from typing import Protocol

import numpy as np


class TerrainSurface(Protocol):
    """Height above mean sea level of every place."""

    @property
    def highest_m(self) -> float:
        """A height that the surface does not exceed [m]."""
        ...

    @property
    def digest(self) -> str:
        """SHA-256 over what it is, in hexadecimal."""
        ...

    def height(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> np.ndarray:
        """Return the height above mean sea level, (...) [m]."""
        ...

    def slope(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise for each meter to the north and to the east, (...) each."""
        ...


@dataclass(frozen=True)
class Flat:
    """The same height everywhere."""

    height_m: float = 0.0

    @property
    def highest_m(self) -> float:
        """The height."""
        return self.height_m

    @property
    def digest(self) -> str:
        """SHA-256 over its height, in hexadecimal."""
        return hashlib.sha256(repr(self.height_m).encode()).hexdigest()

    def height(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> np.ndarray:
        """Return the height above mean sea level, (...) [m]."""
        return np.full(np.broadcast_shapes(np.shape(lat_rad), np.shape(lon_rad)), self.height_m)

    def slope(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise for each meter to the north and to the east, (...) each."""
        zero = np.zeros(np.broadcast_shapes(np.shape(lat_rad), np.shape(lon_rad)))
        return zero, zero.copy()


@dataclass(frozen=True)
class Ground:
    """The ground of a scenario.

    Attributes
    ----------
    surface : TerrainSurface
        Heights above mean sea level.
    geoid_m : float
        Height of mean sea level above the WGS-84 ellipsoid, the same over the whole flight:
        height above the ellipsoid = height above the sea + geoid.
    """

    surface: TerrainSurface
    geoid_m: float = 0.0

    @property
    def level(self) -> bool:
        """Whether the ground has the same height everywhere."""
        return isinstance(self.surface, Flat)

    @property
    def highest_m(self) -> float:
        """A height above the ellipsoid that the ground does not exceed [m]."""
        return self.surface.highest_m + self.geoid_m

    @property
    def digest(self) -> str:
        """SHA-256 over surface and geoid, in hexadecimal."""
        return hashlib.sha256(f"{self.surface.digest} {self.geoid_m!r}".encode()).hexdigest()

    def height(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> np.ndarray:
        """Return the height of the ground above the WGS-84 ellipsoid.

        Parameters
        ----------
        lat_rad, lon_rad : (...) [rad]

        Returns
        -------
        (...) [m]

        Raises
        ------
        DataError
            If a place lies outside a terrain grid.
        """
        return self.surface.height(lat_rad, lon_rad) + self.geoid_m

    def slope(self, lat_rad: np.ndarray, lon_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rise for each meter to the north and to the east, (...) each."""
        return self.surface.slope(lat_rad, lon_rad)

    def above_sea(self, alt_m: np.ndarray) -> np.ndarray:
        """Return the height above mean sea level [m] of a height above the ellipsoid."""
        return alt_m - self.geoid_m
