"""What hangs on rubber mounts: moments, steel and the propeller of an engine, and how the field changes with its way.

All that hangs on some mounts goes the same way ``w``, small beside the distance to any place. To first order the field
changes by ``-w . grad`` of the field of what moves: of each moment, permanent or turning, and of the steel as the
ambient field has magnetized it where it is. That the steel also takes on another charge, as it comes nearer to other
steel, is left out.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from magsim.aircraft.magnetics import Magnetics, RotatingDipole
from magsim.field.metal.steel.model import SteelModel
from magsim.field.sources.moving import dipole_gradient


def rotating_on(magnetics: Magnetics, suspension: str) -> tuple[RotatingDipole, ...]:
    """Return what turns and hangs on some mounts."""
    return tuple(dipole for dipole in magnetics.rotating if dipole.suspension == suspension)


def hanging_gains(magnetics: Magnetics, steel: SteelModel, points: np.ndarray) -> np.ndarray:
    """Return the fields that ``hanging_strengths`` multiply, mounts by mounts, (s, 3, c).

    Parameters
    ----------
    magnetics : Magnetics
    steel : SteelModel
        All its steel, magnetized together.
    points : (s, 3) [m]
    """
    columns = [np.zeros((len(points), 3, 0))]
    for name in magnetics.suspensions:
        names = [each for part in magnetics.steel if part.suspension == name for each in part.names]
        metal = steel.only(names).at(points)
        slope = metal.reaction_gradient_nt_pm.copy()
        for dipole in magnetics.permanent:
            if dipole.suspension == name:
                slope += dipole_gradient(np.array(dipole.position_m), np.array(dipole.moment_am2), points)
        columns += [-slope, -_products(metal.induced_gradient)]
        for turning in rotating_on(magnetics, name):
            units = [dipole_gradient(np.array(turning.position_m), unit, points) for unit in np.eye(3)]
            columns.append(-_products(np.stack(units, axis=2)))
    return np.concatenate(columns, axis=2)


def _products(slopes: np.ndarray) -> np.ndarray:
    """Return derivatives (s, 3, k, j) by the place as gains of the nine products of a strength and a way, (s, 3, 9)."""
    return slopes.reshape(len(slopes), 3, 9)


def hanging_strengths(
    magnetics: Magnetics,
    ways: Mapping[str, np.ndarray],
    ambient_b: np.ndarray,
    moments: Mapping[str, Sequence[np.ndarray]],
) -> np.ndarray:
    """Return the strengths of ``hanging_gains``, (n, c).

    For each mounts in turn: the way [m], its products with the ambient field, and those with each turning moment.

    Parameters
    ----------
    magnetics : Magnetics
    ways : mapping of str to (n, 3) [m]
        Of each mounts, from where the parked aircraft has it.
    ambient_b : (n, 3) [nT]
    moments : mapping of str to sequence of (n, 3) [A m^2]
        Of what turns on each mounts, in the order of ``rotating_on``.
    """
    columns = []
    for name in magnetics.suspensions:
        way = ways[name]
        columns.append(way)
        for strength in (ambient_b, *moments[name]):
            columns.append(np.einsum("nk,nj->nkj", strength, way).reshape(len(way), 9))
    return np.hstack(columns)
