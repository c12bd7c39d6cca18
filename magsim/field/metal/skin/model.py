"""The skin of an aircraft as a model that can be asked for its eddy currents at any places."""

from dataclasses import dataclass, fields

import numpy as np

from magsim.aircraft.magnetics import Body, Skin
from magsim.arrays import readonly
from magsim.field.geometry.meshes import TriangleMesh
from magsim.field.geometry.refine import distance_to_triangles
from magsim.field.metal.eddy import Modes
from magsim.field.metal.skin.mesh import graded, outline
from magsim.field.metal.skin.shells import (
    NO_SEAMS,
    Seams,
    ThinShells,
    driven_modes,
    phasor_streams,
    stream_field,
)
from magsim.storage import kept

Arrays = dict[str, np.ndarray]

ORDERS = 6
"""Orders of lag that the modes hold exactly: 18 modes, with errors below 1e-9 at 0.5 Hz and 1e-6 at 5 Hz."""

MATERIAL = frozenset({"conductivity_spm", "thickness_m", "seams_ohm_m"})
"""Keys of a part that its mesh does not depend on."""

ON_SEAM_M = 1e-9
"""How far a node on a joint may be off its plane: rounding."""

CHECK_HZ = 0.5
"""Frequency at which the error of the modes is evaluated."""


@dataclass(frozen=True)
class SkinModel:
    """Eddy currents in an aircraft's skin.

    Attributes
    ----------
    vertices : (n, 3) [m]
    triangles : (t, 3) int
    tau_s : (k,) [s]
    drive : (k, 3) [m^2 / sqrt(ohm)]
    streams : (n, k) [1 / sqrt(ohm)]
        Stream functions of the modes.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    tau_s: np.ndarray
    drive: np.ndarray
    streams: np.ndarray

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "triangles":
                object.__setattr__(self, item.name, readonly(getattr(self, item.name)))

    @property
    def surface(self) -> TriangleMesh:
        """The mesh."""
        return TriangleMesh(self.vertices, self.triangles)

    def at(self, points: np.ndarray) -> Modes:
        """Return the modes with their field at places, (p, 3) [m] in body axes."""
        return Modes(self.tau_s, self.drive, stream_field(self.surface, self.streams, points))

    def resolved(self, points: np.ndarray) -> np.ndarray:
        """Return whether places (p, 3) [m] are farther from the metal than one edge of its mesh, (p,) bool."""
        corners = self.vertices[self.triangles]
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        return np.all(distance_to_triangles(np.asarray(points, dtype=float), corners) >= longest, axis=1)


def seam_edges(skin: Skin, surface: TriangleMesh, part: np.ndarray) -> Seams:
    """Return the edges of a skin's mesh that lie on joints with a resistance.

    Parameters
    ----------
    skin : Skin
    surface : TriangleMesh
    part : (t,) int
        Number of the part that each triangle belongs to.
    """
    edges, ohm_m = [], []
    for number, shell in enumerate(skin.parts):
        own = surface.triangles[part == number]
        ends = np.unique(np.sort(np.stack([own, np.roll(own, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
        axis = 0 if isinstance(shell, Body) else 1 if shell.span == "right" else 2
        places = surface.vertices[:, axis]
        places = np.abs(places) if axis == 1 else places
        for place, resistance in zip(shell.seam_places_m, shell.seams_ohm_m, strict=False):
            on = ends[np.all(np.abs(places[ends] - place) < ON_SEAM_M, axis=1)]
            edges.append(on)
            ohm_m.append(np.full(len(on), resistance))
    return Seams(np.concatenate(edges), np.concatenate(ohm_m)) if edges else NO_SEAMS


def shells_of(skin: Skin, points: np.ndarray, *, element_m: float | None = None) -> ThinShells:
    """Return the mesh of a skin with its conductances, finer between near parts and around places.

    Parameters
    ----------
    skin : Skin
    points : (p, 3) [m]
        Places of sensors.
    element_m : float, optional [m]
        Instead of the file's.

    Raises
    ------
    ValueError
        If the mesh is not sound, or a place is too close to the metal.
    """
    element = skin.element_m if element_m is None else element_m
    mesh = graded(outline(skin, element_m=element), element, points)
    return _shells(skin, mesh.surface, mesh.part)


def _shells(skin: Skin, surface: TriangleMesh, part: np.ndarray, inductance: np.ndarray | None = None) -> ThinShells:
    conductance = np.array([shell.conductivity_spm * shell.thickness_m for shell in skin.parts])
    return ThinShells(surface, conductance[part], seam_edges(skin, surface, part), inductance)


def compute_skin(skin: Skin, points: np.ndarray) -> SkinModel:
    """Compute the model of a skin with a mesh fine enough for sensors at ``points`` (p, 3) [m].

    Raises
    ------
    ValueError
        If the mesh is not sound, or a place is too close to the metal.
    """
    return SkinModel(**_solve(skin, _geometry(skin, points)))


def truncation_error(skin: Skin, points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the relative error of the modes of a skin at places against all its currents at ``CHECK_HZ``, (p,).

    Parameters
    ----------
    skin : Skin
    points : (s, 3) [m]
        Places of sensors, around which the mesh is fine.
    places : (p, 3) [m]
    """
    geometry, omega = _geometry(skin, points), 2j * np.pi * CHECK_HZ
    model = SkinModel(**_solve(skin, geometry))
    shells = _shells(skin, model.surface, geometry["part"], geometry["inductance"])
    streams = phasor_streams(shells, CHECK_HZ)
    exact = stream_field(model.surface, streams.real, places) + 1j * stream_field(model.surface, streams.imag, places)
    modes = model.at(places)
    got = np.einsum("sik,k,kj->sij", modes.field, -omega / (1.0 + omega * modes.tau_s), modes.drive)
    return np.linalg.norm(got - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))


def load_skin(skin: Skin, points: np.ndarray) -> SkinModel:
    """Return the result of ``compute_skin``, from the cache where it is known.

    Mesh and inductance are cached beside it: they are those of all skins of the same shape.
    """
    shape = skin.model_dump(mode="json", exclude={"parts": {"__all__": {*MATERIAL, "source"}}})

    def solve() -> Arrays:
        return _solve(skin, kept("skin_geometry", {"skin": shape, "points": points}, lambda: _geometry(skin, points)))

    return SkinModel(**kept("skin", {"skin": skin.model_dump(mode="json"), "points": points}, solve))


def _geometry(skin: Skin, points: np.ndarray) -> Arrays:
    """Return mesh and inductance, which do not depend on the metal."""
    mesh = graded(outline(skin), skin.element_m, points)
    shells = _shells(skin, mesh.surface, mesh.part)
    return {
        "vertices": mesh.surface.vertices,
        "triangles": mesh.surface.triangles,
        "part": mesh.part,
        "inductance": shells.inductance,
    }


def _solve(skin: Skin, geometry: Arrays) -> Arrays:
    surface = TriangleMesh(geometry["vertices"], geometry["triangles"])
    shells = _shells(skin, surface, geometry["part"], geometry["inductance"])
    modes = driven_modes(shells, ORDERS)
    return {
        "vertices": shells.surface.vertices,
        "triangles": shells.surface.triangles,
        "tau_s": modes.tau_s,
        "drive": modes.drive,
        "streams": modes.streams,
    }
