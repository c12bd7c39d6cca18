"""What populations scatter in: moments by kind, over those of the type."""

from collections.abc import Callable, Sequence

import numpy as np

from magsim.aircraft import Magnetics, Vehicle
from magsim.aircraft.magnetics import Dipole

Chosen = Callable[[Magnetics], list[Dipole]]


def _dipoles(magnetics: Magnetics) -> list[Dipole]:
    return [*magnetics.permanent, *magnetics.hinged, *magnetics.rotating]


def fittings(magnetics: Magnetics) -> list[Dipole]:
    """Return the moments of small fittings."""
    return [dipole for dipole in _dipoles(magnetics) if dipole.kind == "fitting"]


def machines(magnetics: Magnetics) -> list[Dipole]:
    """Return the moments of engine and motors."""
    return [dipole for dipole in _dipoles(magnetics) if dipole.kind == "machine"]


def sizes_over(nominal: Vehicle, fleet: Sequence[Vehicle], chosen: Chosen) -> tuple[np.ndarray, np.ndarray]:
    """Return sizes over those of the type (n,), and moments (n, 3), individual by individual."""
    of_type = [np.linalg.norm(dipole.moment_am2) for dipole in chosen(nominal.magnetics)]
    moments = np.array([dipole.moment_am2 for one in fleet for dipole in chosen(one.magnetics)])
    return np.linalg.norm(moments, axis=1) / np.tile(of_type, len(fleet)), moments


def angle_deg(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angles between vectors (n, 3) and (n, 3), (n,) [deg]."""
    cross, dot = np.linalg.norm(np.cross(first, second), axis=1), np.einsum("ni,ni->n", first, second)
    return np.degrees(np.arctan2(cross, dot))
