"""Meshes of simple bodies: surfaces of triangles and solids of tetrahedra, without a mesh generator."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import trimesh

FLAT = 1e-9
"""Volume of a cell over the cube of its longest edge below which it counts as flat."""


@final
@dataclass(frozen=True)
class TriangleMesh:
    """A triangle mesh.

    Attributes
    ----------
    vertices : (n, 3) [m]
    triangles : (t, 3) int
        Consistently oriented, outward where the surface is closed.
    """

    vertices: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class Tetrahedra:
    """A tetrahedral mesh.

    Attributes
    ----------
    vertices : (n, 3) [m]
    cells : (e, 4) int
    layer : (e,) int
        Number of the layer that a cell belongs to, from the first section (of a ball: from the center).
    """

    vertices: np.ndarray
    cells: np.ndarray
    layer: np.ndarray


def box_surface(center: Sequence[float], size: Sequence[float], element: float) -> TriangleMesh:
    """Return a closed box of right triangles whose legs are at most ``element`` [m]."""
    counts = [max(1, int(np.ceil(length / element - 1e-9))) for length in size]
    vertices, triangles, start = [], [], 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1.0, 1.0):
            grid = np.zeros((counts[u] + 1, counts[v] + 1, 3))
            grid[..., axis] = 0.5 * sign * size[axis]
            grid[..., u] = (np.linspace(-0.5, 0.5, counts[u] + 1) * size[u])[:, None]
            grid[..., v] = (np.linspace(-0.5, 0.5, counts[v] + 1) * size[v])[None, :]
            number = start + np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2])
            a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
            c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
            faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
            triangles.append(faces if sign > 0 else faces[:, ::-1])
            vertices.append(grid.reshape(-1, 3))
            start += number.size
    mesh = trimesh.Trimesh(np.concatenate(vertices), np.concatenate(triangles), process=False)
    mesh.merge_vertices()
    return TriangleMesh(np.asarray(mesh.vertices) + np.asarray(center, dtype=float), np.asarray(mesh.faces))


def icosphere(subdivisions: int, radius: float, *, keep: str = "radius") -> TriangleMesh:
    """Return a sphere of ``20 * 4**subdivisions`` triangles.

    Parameters
    ----------
    subdivisions : int
    radius : float [m]
    keep : str
        What the polyhedron shares with the sphere: ``"radius"`` (its corners lie on it), ``"area"`` or ``"volume"``.
    """
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=1.0)
    factor = {
        "radius": 1.0,
        "area": np.sqrt(4.0 * np.pi / mesh.area),
        "volume": np.cbrt(4.0 / 3.0 * np.pi / mesh.volume),
    }[keep]
    return TriangleMesh(np.asarray(mesh.vertices) * (radius * factor), np.asarray(mesh.faces))


def extrude(sections: np.ndarray, triangles: np.ndarray) -> Tetrahedra:
    """Return the solid between sections of the same triangulation; each prism is cut into three tetrahedra.

    The corners of a triangle are sorted by number first, so that neighbors cut their common face alike.

    Parameters
    ----------
    sections : (m + 1, n, 3) [m]
        Vertices of each section.
    triangles : (t, 3) int
        Triangulation that all sections share.
    """
    layers, count = len(sections) - 1, sections.shape[1]
    a, b, c = np.sort(triangles, axis=1).T
    prism = np.concatenate(
        [
            np.column_stack([a, b, c, c + count]),
            np.column_stack([a, b, b + count, c + count]),
            np.column_stack([a, a + count, b + count, c + count]),
        ]
    )
    cells = (prism[None] + count * np.arange(layers)[:, None, None]).reshape(-1, 4)
    return Tetrahedra(sections.reshape(-1, 3), cells, np.repeat(np.arange(layers), len(prism)))


def boundary(mesh: Tetrahedra) -> np.ndarray:
    """Return the triangles around a solid, outward, (t, 3) int.

    Raises
    ------
    ValueError
        If cells are flat or lie on each other.
    """
    cells = mesh.cells.copy()
    corners = mesh.vertices[cells]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.linalg.det(edges) / 6.0
    if np.any(np.abs(volume) < FLAT * np.linalg.norm(edges, axis=2).max(axis=1) ** 3):
        msg = "has flat cells; allowed: sections that differ and do not collapse"
        raise ValueError(msg)
    cells[volume < 0.0] = cells[volume < 0.0][:, [0, 2, 1, 3]]
    faces = np.concatenate([cells[:, [1, 2, 3]], cells[:, [0, 3, 2]], cells[:, [0, 1, 3]], cells[:, [0, 2, 1]]])
    # A face between two cells is seen from both sides; the sense is the parity of the order of its corners.
    order = np.argsort(faces, axis=1)
    sense = np.where(np.isin(order @ [9, 3, 1], [5, 15, 19]), 1, -1)  # 012, 120, 201
    keys, owner = np.unique(np.take_along_axis(faces, order, axis=1), axis=0, return_inverse=True)
    count, both = np.bincount(owner.ravel()), np.bincount(owner.ravel(), weights=sense, minlength=len(keys))
    if count.max() > 2 or np.any((count == 2) & (both != 0)):
        msg = "folds over itself; allowed: sections that do not cut each other; move them apart or bend less"
        raise ValueError(msg)
    return faces[count[owner.ravel()] == 1]


def disc_grid(rings: int, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a disc as rings of 6, 12, 18 ... points around a center, scaled to the exact area.

    Returns
    -------
    points : (n, 2) [m]
    triangles : (6 rings^2, 3) int
    """
    points, start = [np.zeros((1, 2))], [0]
    for ring in range(1, rings + 1):
        angle = 2.0 * np.pi * np.arange(6 * ring) / (6 * ring)
        points.append(ring / rings * np.column_stack([np.cos(angle), np.sin(angle)]))
        start.append(start[-1] + len(points[-2]))
    triangles = []
    for ring in range(1, rings + 1):
        outer = [start[ring] + i for i in range(6 * ring)]
        inner = [start[ring - 1] + i for i in range(6 * (ring - 1))] or [0]
        for sector in range(6):
            for i in range(ring):
                o, k = sector * ring + i, sector * (ring - 1) + i
                here, left = outer[o], outer[(o + 1) % len(outer)]
                triangles.append((inner[k % len(inner)], here, left))
                if i < ring - 1:
                    triangles.append((inner[k % len(inner)], left, inner[(k + 1) % len(inner)]))
    flat = np.concatenate(points)
    corner = np.pi / (6 * rings)  # the rim is a regular polygon of 6 rings corners
    return flat * radius * np.sqrt(corner / (np.sin(corner) * np.cos(corner))), np.array(triangles)


def cylinder(
    center: Sequence[float], axis: Sequence[float], *, radius: float, length: float, rings: int, layers: int
) -> Tetrahedra:
    """Return a solid cylinder of the exact volume: ``rings`` elements along the radius, ``layers`` along the axis."""
    along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    helper = np.eye(3)[np.argmin(np.abs(along))]
    first = np.cross(along, helper)
    first /= np.linalg.norm(first)
    second = np.cross(along, first)
    flat, triangles = disc_grid(rings, radius)
    section = np.einsum("p,x->px", flat[:, 0], first) + np.einsum("p,x->px", flat[:, 1], second)
    height = np.linspace(-0.5, 0.5, layers + 1) * length
    sections = np.asarray(center, dtype=float) + section + height[:, None, None] * along
    return extrude(sections, triangles)


def ball(subdivisions: int, radii: Sequence[float]) -> Tetrahedra:
    """Return a solid sphere of nested icospheres of exact volume, with cells that meet in the center.

    Parameters
    ----------
    subdivisions : int
        Of each icosphere.
    radii : sequence of float [m]
        Increasing; the last one is the radius of the ball. Layer 0 is inside the first.
    """
    shell = icosphere(subdivisions, 1.0, keep="volume")
    sections = np.stack([shell.vertices * radius for radius in radii])
    hull = (
        extrude(sections, shell.triangles)
        if len(radii) > 1
        else Tetrahedra(sections[0], np.empty((0, 4), int), np.empty(0, int))
    )
    center = len(hull.vertices)
    core = np.column_stack([shell.triangles, np.full(len(shell.triangles), center)])
    layer = np.concatenate([np.zeros(len(core), dtype=int), np.asarray(hull.layer, dtype=int) + 1])
    return Tetrahedra(np.vstack([hull.vertices, np.zeros(3)]), np.concatenate([core, hull.cells]), layer)
