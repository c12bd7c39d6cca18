"""The steel of an aircraft: its parts as meshes, magnetized together, and what that does at any place."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from magsim.aircraft import Vehicle
from magsim.aircraft.magnetics import (
    FixedDipole,
    Steel,
)
from magsim.arrays import readonly
from magsim.errors import RequestError
from magsim.field.geometry.panels import Panels
from magsim.field.geometry.soundness import element_sizes, place, point_triangle, winding
from magsim.field.metal.steel.family import SteelFamily, in_family, load_family, weights_of
from magsim.field.metal.steel.induced import (
    InducedModel,
    charge_field,
    charge_gradient,
)
from magsim.field.metal.steel.meshing import check_apart, steel_parts, walls_of
from magsim.field.metal.steel.reaction import dipole_charge
from magsim.storage import kept
from magsim.threads import one_blas_thread
from magsim.units import MU0, NT_PER_T

Arrays = dict[str, np.ndarray]

KEEP_OFF = 0.5
"""Elements that a place must be away from the steel: there the field is still within a percent."""


@dataclass(frozen=True)
class SteelField:
    """What the steel adds at ``p`` places.

    Attributes
    ----------
    induced : (p, 3, 3)
        ``D``: the induced field is ``D @ B_0``.
    induced_gradient : (p, 3, 3, 3) [1/m]
        ``dD_ik/dx_j``, indexed (p, i, k, j).
    reaction_nt : (p, 3) [nT]
        Field of what the permanent moments induce that are not installed ones.
    reaction_gradient_nt_pm : (p, 3, 3) [nT/m]
        ``dB_i/dx_j`` of it.
    """

    induced: np.ndarray
    induced_gradient: np.ndarray
    reaction_nt: np.ndarray
    reaction_gradient_nt_pm: np.ndarray


@dataclass(frozen=True)
class SteelModel:
    """Magnetized steel: the charge on its triangles for unit ambient fields, and for the permanent moments.

    Attributes
    ----------
    names : tuple of str
        Of the parts.
    corners : (t, 3, 3) [m]
        Triangles that carry charge.
    part : (t,) int
        Number of the part that each belongs to.
    charge : (t, 3) [A/m]
        For ambient fields of 1 A/m along x, y and z.
    reaction : (t,) [A/m]
        For the permanent moments that are not installed ones.
    polarizability : (3, 3) [m^3]
        Moment of all parts together for an ambient field of 1 A/m.
    walls : (w, 3, 3) [m]
        Triangles around the solid parts, outward.
    wall_part : (w,) int
    """

    names: tuple[str, ...]
    corners: np.ndarray
    part: np.ndarray
    charge: np.ndarray
    reaction: np.ndarray
    polarizability: np.ndarray
    walls: np.ndarray
    wall_part: np.ndarray

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name in ("part", "wall_part"):
                numbers = np.array(getattr(self, item.name), dtype=int)
                numbers.flags.writeable = False
                object.__setattr__(self, item.name, numbers)
            elif item.name != "names":
                object.__setattr__(self, item.name, readonly(getattr(self, item.name)))

    def at(self, points: np.ndarray, *, gradient: bool = True) -> SteelField:
        """Return the field of the steel at places in the air.

        Parameters
        ----------
        points : (p, 3) [m]
            Body axes.
        gradient : bool
            Whether the gradients are asked for, which take two thirds of the time; else they are NaN.
        """
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        count, panels = len(points), Panels(self.corners)
        both = np.column_stack([self.charge, self.reaction * MU0 * NT_PER_T])
        field, slope = np.zeros((count, 3, 4)), np.full((count, 3, 4, 3), 0.0 if gradient else np.nan)
        if len(panels):
            field = charge_field(panels, both, points)
            slope = charge_gradient(panels, both, points) if gradient else slope
        return SteelField(field[..., :3], slope[..., :3, :], field[..., 3], slope[..., 3, :])

    def only(self, names: Sequence[str]) -> "SteelModel":
        """Return some parts alone, with the charge that they have beside all others."""
        numbers = [self.names.index(name) for name in names]
        rows, walls = (np.flatnonzero(np.isin(part, numbers)) for part in (self.part, self.wall_part))
        corners, charge = self.corners[rows], self.charge[rows]
        return SteelModel(
            names=self.names,
            corners=corners,
            part=self.part[rows],
            charge=charge,
            reaction=self.reaction[rows],
            polarizability=moment_of(corners, charge),
            walls=self.walls[walls],
            wall_part=self.wall_part[walls],
        )

    def obstacles(self, points: np.ndarray, *, elements: float = KEEP_OFF) -> list[str | None]:
        """Return for each place the steel too close to it, with what is allowed, or None.

        Parameters
        ----------
        points : (p, 3) [m]
        elements : float
            How far a place must be from the steel, in sizes of the triangles there.
        """
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        out: list[str | None] = [None] * len(points)
        for number, name in enumerate(self.names):
            walls = self.walls[self.wall_part == number]
            if len(walls):
                low, high = walls.min(axis=(0, 1)), walls.max(axis=(0, 1))
                rows = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1))
                for row in rows[winding(walls, points[rows]) != 0]:
                    out[row] = out[row] or f"inside steel part {name!r}; allowed: a place in the air"
        sizes = elements * element_sizes(self.corners) if len(self.corners) else np.zeros(0)
        centers = self.corners.mean(axis=1)
        reach = np.linalg.norm(self.corners - centers[:, None], axis=2).max(axis=1, initial=0.0) + sizes
        for row, point in enumerate(points):
            near = np.flatnonzero(np.linalg.norm(point - centers, axis=1) < reach)
            if out[row] is not None or not len(near):
                continue
            distance = point_triangle(np.broadcast_to(point, (len(near), 3)), self.corners[near])
            worst = int(np.argmin(distance / sizes[near]))
            if distance[worst] < sizes[near[worst]]:
                name = self.names[self.part[near[worst]]]
                out[row] = (
                    f"{distance[worst]:.3g} m from steel part {name!r}; "
                    f"allowed: at least {sizes[near[worst]]:.3g} m, {elements:g} elements of its mesh there"
                )
        return out

    def check(self, places: Mapping[str, ArrayLike], *, elements: float = KEEP_OFF) -> None:
        """Refuse places inside metal or closer to it than its mesh resolves.

        Parameters
        ----------
        places : mapping of str to (3,) [m]
            By the words that name them, like ``mount 'cabin'``.
        elements : float
            How far they must be from the steel.

        Raises
        ------
        RequestError
            One line for each place.
        """
        points = np.array(list(places.values()), dtype=float).reshape(-1, 3)
        found = zip(places, points, self.obstacles(points, elements=elements), strict=True)
        lines = [f"{what} at {place(point)} is {obstacle}" for what, point, obstacle in found if obstacle is not None]
        if lines:
            raise RequestError("\n".join(lines))


def moment_of(corners: np.ndarray, charge: np.ndarray) -> np.ndarray:
    """Return the moments of charges (t, k) [A/m] on triangles (t, 3, 3) [m] about the datum, (3, k) [A m^2]."""
    panels = Panels(corners)
    return np.einsum("t,ti,tk->ik", panels.areas, panels.centroids, charge)


def _solve(steel: Sequence[Steel], dipoles: Sequence[FixedDipole], files: Mapping[str, bytes]) -> Arrays:
    """Return the arrays of a ``SteelModel`` by name."""
    parts = steel_parts(steel, files)
    check_apart(parts)
    # LU and Cholesky give other last bits on another number of threads.
    with one_blas_thread():
        try:
            model = InducedModel(list(parts.values()))
        except ValueError as error:
            msg = f"the steel cannot be magnetized: {error}"
            raise RequestError(msg) from error
        walls = [walls_of(part) for part in parts.values()]
        arrays = {
            "corners": model.panels.corners,
            "part": model.part,
            "charge": model.uniform,
            "reaction": np.zeros(len(model.panels)),
            "polarizability": model.moment(),
            "walls": np.concatenate(walls),
            "wall_part": np.repeat(np.arange(len(walls)), [len(wall) for wall in walls]),
        }
        bare = {f"dipole {d.name!r}, which is not installed,": d.position_m for d in dipoles if not d.installed}
        try:
            SteelModel(tuple(parts), **arrays).check(bare, elements=1.0)
        except RequestError as error:
            msg = f"{error}; or give its installed moment with installed = true"
            raise RequestError(msg) from error
        for dipole in dipoles:
            if not dipole.installed:
                arrays["reaction"] += dipole_charge(model, np.array(dipole.position_m), np.array(dipole.moment_am2))
    return arrays


def file_digests(aircraft: Vehicle) -> dict[str, str]:
    """Return SHA-256 of the files of triangles of an aircraft, by name."""
    return {name: hashlib.sha256(content).hexdigest() for name, content in aircraft.files.items()}


def compute_steel(aircraft: Vehicle) -> SteelModel:
    """Compute the magnetized steel of an aircraft on one thread.

    Parameters
    ----------
    aircraft : Vehicle
        Its steel, its permanent moments and the files of triangles count.

    Raises
    ------
    RequestError
        If a part's mesh is not sound, parts touch, or a moment that is not an installed one lies in or at the steel.
    """
    return _model(aircraft, lambda _, make: make())


def load_steel(aircraft: Vehicle) -> SteelModel:
    """Return the result of ``compute_steel``, from the cache where it is known.

    An individual is computed in the family of its type, unless a moment is not an installed one or parts differ
    by more than their material: the field agrees with that of ``compute_steel`` to 1e-7.
    """
    nominal = aircraft.nominal
    own, bare = aircraft.magnetics.steel, any(not dipole.installed for dipole in aircraft.magnetics.permanent)
    if nominal is None or bare or own == nominal.magnetics.steel or not in_family(own, nominal.magnetics.steel):
        return _model(aircraft, lambda key, make: kept("steel", key, make))
    of_type = nominal.magnetics.steel

    def member() -> Arrays:
        return _member(load_family(of_type, nominal.files, file_digests(nominal)), weights_of(own))

    family = {"family": [part.model_dump(mode="json", exclude={"source"}) for part in of_type]}
    return _model(aircraft, lambda key, _: kept("steel", key | family, member))


def _member(family: SteelFamily, weights: np.ndarray) -> Arrays:
    """Return the arrays of a ``SteelModel`` of a family by name."""
    charge = family.charge(weights)
    return {
        "corners": family.corners,
        "part": family.part,
        "charge": charge,
        "reaction": np.zeros(len(charge)),
        "polarizability": moment_of(family.corners, charge),
        "walls": family.walls,
        "wall_part": family.wall_part,
    }


def _model(aircraft: Vehicle, get: Callable[[dict[str, object], Callable[[], Arrays]], Arrays]) -> SteelModel:
    steel = aircraft.magnetics.steel
    dipoles = [dipole for dipole in aircraft.magnetics.permanent if not dipole.installed]
    if not steel:
        none = np.empty((0, 3, 3))
        return SteelModel((), none, np.empty(0), np.empty((0, 3)), np.empty(0), np.zeros((3, 3)), none, np.empty(0))
    key: dict[str, object] = {
        "steel": [part.model_dump(mode="json", exclude={"source"}) for part in steel],
        "dipoles": [dipole.model_dump(mode="json", exclude={"source"}) for dipole in dipoles],
        "files": file_digests(aircraft),
    }
    names = tuple(name for part in steel for name in part.names)
    try:
        return SteelModel(names, **get(key, lambda: _solve(steel, dipoles, aircraft.files)))
    except RequestError as error:
        lines = [f"aircraft {aircraft.name}: {line}" for line in str(error).splitlines()]
        raise RequestError("\n".join(lines)) from error
