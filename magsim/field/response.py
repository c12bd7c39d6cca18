"""What the metal of an aircraft does at each of its mounts: a pure function of its magnetic file."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from magsim.aircraft import Magnetics, Vehicle
from magsim.aircraft.magnetics import Coil
from magsim.arrays import readonly
from magsim.errors import RequestError
from magsim.field.hanging import hanging_gains
from magsim.field.metal.coils import Loop, inductance_matrix
from magsim.field.metal.eddy import Modes, reduce_to_modes, slow_limit
from magsim.field.metal.skin.mesh import metal_obstacles, outline
from magsim.field.metal.skin.model import SkinModel, load_skin
from magsim.field.metal.steel.model import SteelModel, compute_steel, file_digests, load_steel
from magsim.field.sources.dipoles import dipole_field
from magsim.field.wiring.harness import Wiring
from magsim.population.spreads import MAGNETS
from magsim.storage import cached
from magsim.threads import one_blas_thread

Arrays = dict[str, np.ndarray]


@dataclass(frozen=True)
class AircraftResponse:
    """Response of an aircraft at its mounts, in body axes.

    Attributes
    ----------
    mounts : tuple of str
    positions_m : (s, 3) [m]
    permanent_nt : (s, 3) [nT]
        Field of the fixed dipoles, with what those that are not installed ones induce in the steel.
    magnets_nt : (s, 3, 3) [nT]
        What of it is of the magnets of each material, in the order of ``magsim.population.MAGNETS``.
    induced : (s, 3, 3)
        ``D``: induced field is ``D @ B_0``.
    tau_s : (k,) [s]
        Time constants of the eddy-current modes.
    drive : (k, 3) [m^2 / sqrt(ohm)]
    field : (s, 3, k) [T / (A sqrt(ohm))]
        See ``magsim.field.metal.eddy.Modes``.
    wiring_nt_per_a : (s, 3, c) [nT/A]
        Field of each feeder for 1 A.
    hanging : (s, 3, h)
        Change of the field as what hangs on rubber mounts goes; see ``magsim.field.hanging``.
    """

    mounts: tuple[str, ...]
    positions_m: np.ndarray
    permanent_nt: np.ndarray
    magnets_nt: np.ndarray
    induced: np.ndarray
    tau_s: np.ndarray
    drive: np.ndarray
    field: np.ndarray
    wiring_nt_per_a: np.ndarray
    hanging: np.ndarray

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "mounts":
                object.__setattr__(self, item.name, readonly(getattr(self, item.name)))

    @property
    def modes(self) -> Modes:
        """The eddy-current modes."""
        return Modes(self.tau_s, self.drive, self.field)

    @property
    def eddy_slow_s(self) -> np.ndarray:
        """``E`` with ``B_eddy = E dB_0/dt`` for slow motion, (s, 3, 3) [s]."""
        return slow_limit(self.modes)

    def rows(self, mounts: tuple[str, ...]) -> np.ndarray:
        """Return the row numbers of mounts, (m,) int."""
        return np.array([self.mounts.index(mount) for mount in mounts], dtype=int)


def _fixed(magnetics: Magnetics, steel: SteelModel, points: np.ndarray) -> Arrays:
    """Return the gains of steel and fixed dipoles; dipoles not marked as installed magnetize the steel too."""
    field = steel.at(points, gradient=False)
    permanent, magnets = field.reaction_nt.copy(), np.zeros((len(points), 3, len(MAGNETS)))
    for dipole in magnetics.permanent:
        alone = dipole_field(np.array(dipole.position_m), np.array(dipole.moment_am2), points)
        permanent += alone
        if dipole.magnet is not None:
            magnets[:, :, list(MAGNETS).index(dipole.magnet)] += alone
    return {"permanent_nt": permanent, "magnets_nt": magnets, "induced": field.induced}


def coil_loops(coils: tuple[Coil, ...]) -> tuple[list[Loop], list[Coil]]:
    """Return loops with their mirror images, and the coil that each of them comes from."""
    loops: list[Loop] = []
    origins: list[Coil] = []
    for coil in coils:
        vertices = np.array(coil.vertices_m)
        loops.append(Loop(vertices, coil.wire_radius_m))
        origins.append(coil)
        if coil.mirror:
            loops.append(Loop(vertices * (1.0, -1.0, 1.0), coil.wire_radius_m))
            origins.append(coil)
    return loops, origins


def _coils(aircraft: Vehicle, points: np.ndarray) -> Modes:
    loops, origins = coil_loops(aircraft.magnetics.coils)
    matrix = inductance_matrix(loops)
    resistance = np.zeros_like(matrix)
    for i, (loop, coil) in enumerate(zip(loops, origins, strict=True)):
        if coil.conductivity_spm is not None and coil.section_m2 is not None:
            resistance[i, i] = loop.length_m / (coil.conductivity_spm * coil.section_m2)
        elif coil.time_constant_s is not None:
            resistance[i, i] = matrix[i, i] / coil.time_constant_s
    flux = np.array([loop.area_vector for loop in loops]).reshape(-1, 3)
    field = np.stack([loop.field(points) for loop in loops], axis=-1) if loops else np.zeros((len(points), 3, 0))
    return reduce_to_modes(matrix, resistance, flux, field)


def _skin(aircraft: Vehicle, points: np.ndarray) -> Modes:
    return skin_model(aircraft).at(points)


def _wiring(magnetics: Magnetics, points: np.ndarray) -> Arrays:
    return {"wiring_nt_per_a": Wiring.of(magnetics).at(points)}


def skin_model(aircraft: Vehicle) -> SkinModel:
    """Return the aircraft's skin, fine enough for all its mounts, from the cache where it is known.

    An individual has the mesh of its type: its mounts are within some millimeters of where the type has them.

    Raises
    ------
    ValueError
        If the aircraft has no skin, the skin's mesh is not sound, or a mount is too close to the metal.
    """
    skin = aircraft.magnetics.skin
    if skin is None:
        msg = "the aircraft has no skin"
        raise ValueError(msg)
    return load_skin(skin, np.array(list((aircraft.nominal or aircraft).mounts.values())))


EDDY = {"coils": _coils, "skin": _skin}
"""Models of eddy currents: each makes modes of the aircraft with their field at places."""


def _solve(aircraft: Vehicle, places: Mapping[str, ArrayLike], steel: SteelModel, eddy: str) -> Arrays:
    """Compute the arrays of a response by name."""
    points = np.array(list(places.values()), dtype=float).reshape(-1, 3)
    _check_places(aircraft, places, steel)
    arrays = {"positions_m": points}
    # LU, Cholesky and eigh give other last bits on another number of threads.
    with one_blas_thread():
        try:
            arrays |= _fixed(aircraft.magnetics, steel, points)
            modes = EDDY[eddy](aircraft, points)
            arrays |= {"tau_s": modes.tau_s, "drive": modes.drive, "field": modes.field}
            arrays |= _wiring(aircraft.magnetics, points)
            arrays["hanging"] = hanging_gains(aircraft.magnetics, steel, points)
        except ValueError as error:
            msg = f"aircraft {aircraft.name}: {error}"
            raise RequestError(msg) from error
    return arrays


def _check_places(aircraft: Vehicle, places: Mapping[str, ArrayLike], steel: SteelModel) -> None:
    """Refuse places in or at the steel by its mesh."""
    words = {f"{'mount' if name in aircraft.mounts else 'place'} {name!r}": point for name, point in places.items()}
    try:
        steel.check(words)
    except RequestError as error:
        lines = [f"aircraft {aircraft.name}: {line}" for line in str(error).splitlines()]
        raise RequestError("\n".join(lines)) from error


def eddy_model(aircraft: Vehicle, asked: str | None = None) -> str:
    """Name of the model of eddy currents that is used: what is asked, else what the aircraft's file gives.

    Raises
    ------
    RequestError
        If a skin is asked of an aircraft that has none.
    """
    if asked == "skin" and aircraft.magnetics.skin is None:
        msg = f"aircraft {aircraft.name} has no [skin] in its magnetics.toml; allowed: field.eddy.model = 'coils'"
        raise RequestError(msg)
    return asked or aircraft.magnetics.eddy_model


def compute_response(aircraft: Vehicle, eddy: str | None = None) -> AircraftResponse:
    """Compute the response of an aircraft at all its mounts on one thread; its skin has a cache of its own.

    Parameters
    ----------
    aircraft : Vehicle
        Only its ``magnetics`` count, and the files that they name.
    eddy : str, optional
        ``"skin"`` or ``"coils"``; see ``eddy_model``.

    Raises
    ------
    RequestError
        If a place is in or at the metal, steel parts touch, or a mesh is not sound.
    """
    mounts, model = aircraft.mounts, eddy_model(aircraft, eddy)
    return AircraftResponse(tuple(mounts), **_solve(aircraft, mounts, compute_steel(aircraft), model))


def response_at(aircraft: Vehicle, places: Mapping[str, ArrayLike], eddy: str | None = None) -> AircraftResponse:
    """Return the response of an aircraft at any places; steel and skin are solved once and cached.

    The mesh of a skin is fine near the aircraft's own mounts; ``skin_model(...).resolved`` returns whether it is fine
    enough for other places.

    Parameters
    ----------
    aircraft : Vehicle
        Only its ``magnetics`` count, and the files that they name.
    places : mapping of str to (3,) [m]
        Body axes; by name.
    eddy : str, optional
        ``"skin"`` or ``"coils"``; see ``eddy_model``.

    Raises
    ------
    RequestError
        If a place is in or at the steel, a mount at the skin, steel parts touch, or a mesh is not sound.
    """
    model = eddy_model(aircraft, eddy)
    return AircraftResponse(tuple(places), **_solve(aircraft, places, load_steel(aircraft), model))


def obstacles(aircraft: Vehicle, points: np.ndarray) -> list[str | None]:
    """Return for each place the obstacle to a sensor, with what is allowed, or None.

    Parameters
    ----------
    aircraft : Vehicle
    points : (p, 3) [m]
        Body axes.
    """
    meshes, skin = load_steel(aircraft).obstacles(points), aircraft.magnetics.skin
    shells = [None] * len(points) if skin is None else metal_obstacles(outline(skin), points)
    return [
        aircraft.magnetics.obstacle((x, y, z)) or mesh or shell
        for (x, y, z), mesh, shell in zip(points.tolist(), meshes, shells, strict=True)
    ]


def load_response(
    aircraft: Vehicle, eddy: str | None = None, *, mounts: tuple[str, ...] | None = None
) -> AircraftResponse:
    """Return the result of ``compute_response``, from the cache where it is known.

    The cache counts the source code of ``magsim.field`` into the key.

    Parameters
    ----------
    aircraft : Vehicle
    eddy : str, optional
        ``"skin"`` or ``"coils"``; see ``eddy_model``.
    mounts : tuple of str, optional
        Those that are asked for, by default all. Of an individual others are left out: it is flown with few sensors,
        and a type, whose response holds them all, with any.
    """
    model, names = eddy_model(aircraft, eddy), tuple(aircraft.mounts)
    if mounts is not None and aircraft.nominal is not None:
        names = tuple(name for name in names if name in mounts)
    places = {name: aircraft.mounts[name] for name in names}
    # What is drawn alone does not count.
    key = {
        "magnetics": [
            None if vehicle is None else vehicle.magnetics.model_dump(mode="json", exclude={"outline"})
            for vehicle in (aircraft, aircraft.nominal)
        ],
        "files": file_digests(aircraft),
        "eddy": model,
        "mounts": names,
    }
    return AircraftResponse(
        names, **cached("response", key, lambda: _solve(aircraft, places, load_steel(aircraft), model))
    )
