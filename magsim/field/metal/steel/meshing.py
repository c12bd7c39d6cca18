"""The steel parts of an aircraft file as meshes for the solver."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from magsim.aircraft.magnetics import (
    Bar,
    BoxSheet,
    Cylinder,
    Loft,
    MeshPart,
    Plate,
    Steel,
    Strip,
    Tube,
)
from magsim.errors import RequestError
from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh, boundary, box_surface, cylinder
from magsim.field.geometry.meshfile import placed, read_surface
from magsim.field.geometry.soundness import check_surface, first_touch, place, winding
from magsim.field.metal.steel.induced import (
    ClosedBody,
    Part,
    Sheet,
    Solid,
    charge_triangles,
)
from magsim.field.metal.steel.shapes import loft, mirrored, plate, strip, tube

MAX_PANELS = 8000
"""Most charged triangles of all parts together: half a gigabyte, and a quarter of a minute."""


def _sheet_surface(part: BoxSheet | Plate | Strip | Tube) -> TriangleMesh:
    if isinstance(part, BoxSheet):
        return box_surface(part.center_m, part.size_m, part.element_m)
    if isinstance(part, Plate):
        return plate(part.center_m, part.normal, part.along, part.size_m, part.element_m)
    points = np.array(part.points_m)
    if isinstance(part, Strip):
        return strip(points, np.array(part.facing), part.width_m, part.element_m)
    return tube(points, part.radius_m, part.sides, part.element_m, closed=part.closed)


def _solid(part: Bar | Cylinder | Loft) -> Tetrahedra:
    if isinstance(part, Cylinder):
        return cylinder(
            part.center_m, part.axis, radius=part.radius_m, length=part.length_m, rings=part.rings, layers=part.layers
        )
    if isinstance(part, Bar):
        half = 0.5 * part.size_m[0] * np.array(part.along)
        centers = np.array(part.center_m) + np.stack([-half, half])
        return loft(centers, np.array([part.size_m[1:]] * 2), np.array(part.across), part.element_m)
    centers = np.array([section.center_m for section in part.sections])
    sizes = np.array([section.size_m for section in part.sections])
    return loft(centers, sizes, np.array(part.across), part.element_m, round_section=part.shape == "ellipse")


def _from_file(part: MeshPart, files: Mapping[str, bytes]) -> TriangleMesh:
    if part.file not in files:
        msg = "was not read with the aircraft; allowed: an aircraft that holds its files"
        raise ValueError(msg)
    surface = read_surface(files[part.file], part.file.rpartition(".")[2])
    structural = part.axes == "structural"
    surface = placed(surface, unit_m=part.unit_m, structural=structural, position=np.array(part.position_m))
    return check_surface(surface, closed=part.body == "solid")


def _part(part: Steel, files: Mapping[str, bytes]) -> Part:
    """Return a part for the solver; refuse one that crosses itself.

    Raises
    ------
    ValueError
        If its mesh is not sound; the text continues the part's name.
    """
    chi = part.mu_r - 1.0
    if isinstance(part, MeshPart):
        surface = _from_file(part, files)
        return ClosedBody(surface, chi) if part.thickness_m is None else Sheet(surface, part.thickness_m, chi)
    if isinstance(part, Bar | Cylinder | Loft):
        mesh = _solid(part)
        walls = boundary(mesh)
        if isinstance(part, Loft):
            check_surface(TriangleMesh(mesh.vertices, walls), closed=True)
        return Solid(mesh, chi)
    surface = _sheet_surface(part)
    if not isinstance(part, BoxSheet | Plate):
        check_surface(surface, closed=False)
    return Sheet(surface, part.thickness_m, chi)


def steel_parts(steel: Sequence[Steel], files: Mapping[str, bytes] | None = None) -> dict[str, Part]:
    """Return all parts of an aircraft with their mirror images, by name.

    Parameters
    ----------
    steel : sequence of Steel
    files : mapping of str to bytes, optional
        Files of triangles by name.

    Raises
    ------
    RequestError
        If a part's mesh is not sound, or there are too many triangles.
    """
    out: dict[str, Part] = {}
    for part in steel:
        try:
            made = _part(part, files or {})
        except ValueError as error:
            file = f" ({part.file})" if isinstance(part, MeshPart) else ""
            msg = f"steel part {part.name!r}{file} {error}"
            raise RequestError(msg) from error
        for name, sided in zip(part.names, (made, _mirrored(made)), strict=False):
            out[name] = sided
    counts = {name: len(charge_triangles(part)) for name, part in out.items()}
    if sum(counts.values()) > MAX_PANELS:
        most = max(counts, key=lambda name: counts[name])
        msg = (
            f"the steel has {sum(counts.values())} charged triangles, most of them {most!r} with {counts[most]}; "
            f"allowed: up to {MAX_PANELS}; larger elements make fewer"
        )
        raise RequestError(msg)
    return out


def _mirrored(part: Part) -> Part:
    """Return a part on the other side of the aircraft."""
    if isinstance(part, Solid):
        return replace(part, mesh=mirrored(part.mesh))
    return replace(part, mesh=mirrored(part.mesh))


def walls_of(part: Part) -> np.ndarray:
    """Return the triangles around a solid part, outward, (w, 3, 3) [m]; none of a sheet."""
    if isinstance(part, Sheet):
        return np.empty((0, 3, 3))
    return part.mesh.vertices[boundary(part.mesh) if isinstance(part, Solid) else part.mesh.triangles]


def check_apart(parts: Mapping[str, Part]) -> None:
    """Refuse parts that touch, or lie in the metal of another.

    Raises
    ------
    RequestError
    """
    corners = {name: part.mesh.vertices[charge_triangles(part)] for name, part in parts.items()}
    names = list(parts)
    for number, name in enumerate(names):
        for other in names[number + 1 :]:
            touch = first_touch(corners[name], corners[other])
            if touch is not None:
                where, distance = touch
                how = "touch or cross" if distance == 0.0 else f"are only {distance:.2g} m apart"
                msg = (
                    f"steel parts {name!r} and {other!r} {how} at {place(where)}; allowed: a gap of a fiftieth of an "
                    "element; leave one, or make them one part"
                )
                raise RequestError(msg)
    for outer, part in parts.items():
        around = walls_of(part)
        for name in names if len(around) else ():
            if name != outer and winding(around, corners[name][:1, 0])[0] != 0:
                msg = f"steel part {name!r} lies inside steel part {outer!r}; allowed: parts that do not overlap"
                raise RequestError(msg)
