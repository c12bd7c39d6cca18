"""The aircraft's outline: the shells of its skin as one checked mesh."""

from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from scipy.spatial import cKDTree

from magsim.aircraft.magnetics import BodyShell, DrawnOutline, Skin
from magsim.aircraft.magnetics.skin import PanelShell
from magsim.field.geometry.meshes import TriangleMesh
from magsim.field.geometry.refine import distance_to_triangles, refine
from magsim.field.geometry.soundness import check_surface, first_touch, place
from magsim.field.metal.skin.lofts import around, ellipse, loft, perimeter, stations, superellipse

PART_RATIO = 3.0
"""Longest edge over the gap to another part."""

CLEARANCE_M = 0.03
"""Least distance of a sensor from the skin: the metal is a sheet without thickness, and frames are not modeled."""


@dataclass(frozen=True)
class Outline:
    """Closed shells, joined.

    Attributes
    ----------
    names : tuple of str
        Of the parts.
    surface : TriangleMesh
        All of them; parts share no vertex.
    part : (t,) int
        Number of the part that each triangle belongs to.
    """

    names: tuple[str, ...]
    surface: TriangleMesh
    part: np.ndarray

    def of(self, name: str) -> TriangleMesh:
        """Return one part alone, its vertices renumbered."""
        triangles = self.surface.triangles[self.part == self.names.index(name)]
        used, number = np.unique(triangles, return_inverse=True)
        return TriangleMesh(self.surface.vertices[used], number.reshape(triangles.shape))

    @property
    def extent_m(self) -> np.ndarray:
        """Least and greatest place along each axis, (2, 3) [m]."""
        return np.stack([self.surface.vertices.min(axis=0), self.surface.vertices.max(axis=0)])


def _body(part: BodyShell, element: float) -> TriangleMesh:
    table = np.array([(s.x_m, s.y_m, s.width_m, s.height_m, s.z_m, s.exponent) for s in part.sections])
    count = around(max(perimeter((w / 2, h / 2), e) for _, _, w, h, _, e in table), 0.75 * element)
    ends = [_body_ring(row, count) for row in table]
    rows = stations(table, _distances(ends), element)
    return loft(np.stack([_body_ring(row, count) for row in rows]))


def _body_ring(row: np.ndarray, count: int) -> np.ndarray:
    x, y, width, height, z, exponent = row
    flat = superellipse(count, (width / 2, height / 2), exponent)
    return np.column_stack([np.full(count, x), flat[:, 0] + y, flat[:, 1] + z])


def _panel(part: PanelShell, element: float) -> TriangleMesh:
    table = np.array([(s.at_m, s.leading_edge_m, s.chord_m, s.depth_m, s.offset_m) for s in part.sections])
    count = around(max(perimeter((c / 2, d / 2)) for _, _, c, d, _ in table), 0.5 * element)
    ends = [_panel_ring(row, count, part.span) for row in table]
    rows = stations(table, _distances(ends), element)
    rings = np.stack([_panel_ring(row, count, part.span) for row in rows])
    return loft(rings, mirror=part.span == "right")


def _panel_ring(row: np.ndarray, count: int, span: str) -> np.ndarray:
    at, leading, chord, depth, offset = row
    flat = ellipse(count, (chord / 2, depth / 2))
    x, across, along = flat[:, 0] + leading - chord / 2, flat[:, 1] + offset, np.full(count, at)
    return np.column_stack([x, along, across] if span == "right" else [x, across, along])


def _distances(rings: list[np.ndarray]) -> list[float]:
    return [float(np.linalg.norm(b - a, axis=1).max()) for a, b in pairwise(rings)]


def join(meshes: dict[str, TriangleMesh]) -> Outline:
    """Join the meshes of several parts, without any check."""
    triangles, start = [], 0
    for mesh in meshes.values():
        triangles.append(mesh.triangles + start)
        start += len(mesh.vertices)
    vertices = np.concatenate([mesh.vertices for mesh in meshes.values()])
    part = np.repeat(np.arange(len(meshes)), [len(mesh.triangles) for mesh in meshes.values()])
    return Outline(tuple(meshes), TriangleMesh(vertices, np.concatenate(triangles)), part)


def outline(skin: Skin | DrawnOutline, *, element_m: float | None = None) -> Outline:
    """Mesh the shells of an aircraft's skin, or of the outline of an aircraft without one.

    Parameters
    ----------
    skin : Skin or DrawnOutline
    element_m : float, optional [m]
        Edge of the mesh along the parts, instead of the file's.

    Returns
    -------
    Outline
        Closed, oriented outward; shells of a skin do not cross each other.

    Raises
    ------
    ValueError
        If a part is open or degenerate, or parts cross each other or themselves: which part, where, what to do.
    """
    element = skin.element_m if element_m is None else element_m
    meshes = {
        part.name: _body(part, element) if isinstance(part, BodyShell) else _panel(part, element) for part in skin.parts
    }
    if isinstance(skin, DrawnOutline):
        return checked(join(meshes), what="outline", apart=False)
    return checked(join(meshes))


def checked(whole: Outline, *, what: str = "skin", apart: bool = True) -> Outline:
    """Check that the parts of an outline are closed and sound, and apart where they have to be.

    Raises
    ------
    ValueError
        As ``outline``.
    """
    corners = whole.surface.vertices[whole.surface.triangles]
    for name in whole.names:
        try:
            check_surface(whole.of(name), closed=True)
        except ValueError as error:
            msg = f"{what} part {name!r} {error}"
            raise ValueError(msg) from error
    for first, second in combinations(range(len(whole.names) if apart else 0), 2):
        touch = first_touch(corners[whole.part == first], corners[whole.part == second])
        if touch is not None:
            msg = (
                f"skin parts {whole.names[first]!r} and {whole.names[second]!r} touch or cross at {place(touch[0])}; "
                "allowed: separate parts; move or narrow their sections there so that a gap is left"
            )
            raise ValueError(msg)
    return whole


def metal_obstacles(whole: Outline, points: np.ndarray) -> list[str | None]:
    """Return for each place (p, 3) [m] the skin too close to it, with what is allowed, or None."""
    near = distance_to_triangles(np.asarray(points, dtype=float), whole.surface.vertices[whole.surface.triangles])
    return [
        f"{row.min():.3g} m from skin part {whole.names[whole.part[np.argmin(row)]]!r}; "
        f"allowed: at least {CLEARANCE_M:g} m"
        if row.min() < CLEARANCE_M
        else None
        for row in near
    ]


def graded(whole: Outline, element: float, points: np.ndarray) -> Outline:
    """Refine an outline where currents or their field change over a short distance.

    Where parts come close to each other, opposite currents flow face to face: edges there are no longer than
    ``PART_RATIO`` times the gap, or than half an ``element`` where the gap is smaller still. Near a point, they are
    no longer than its distance.

    Parameters
    ----------
    whole : Outline
    element : float [m]
    points : (p, 3) [m]
        Places of sensors.

    Raises
    ------
    ValueError
        If a point is closer to the metal than ``CLEARANCE_M``: which part, how close.
    """
    for point, obstacle in zip(points, metal_obstacles(whole, points), strict=True):
        if obstacle is not None:
            msg = f"the place {place(point)} is {obstacle}"
            raise ValueError(msg)
    corners = whole.surface.vertices[whole.surface.triangles]
    grid = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4.0
    trees = []
    for part in range(len(whole.names)):
        others = np.einsum("qc,tcx->tqx", grid, corners[whole.part != part]).reshape(-1, 3)
        trees.append(cKDTree(others) if len(others) else None)

    def too_large(corners: np.ndarray, parent: np.ndarray) -> np.ndarray:
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        out = np.zeros(len(corners), dtype=bool)
        for part, tree in enumerate(trees):
            rows = np.flatnonzero((whole.part[parent] == part) & (longest > 0.5 * element))
            if tree is None or not len(rows):
                continue
            # A triangle reaches no further from its centroid than two thirds of its longest edge.
            around_it = tree.query(corners[rows].mean(axis=1))[0]
            rows = rows[around_it < (2.0 / 3.0 + 1.0 / PART_RATIO) * longest[rows]]
            if not len(rows):
                continue
            gap = tree.query(np.einsum("qc,tcx->tqx", grid, corners[rows]))[0].min(axis=1)
            out[rows] = longest[rows] > np.maximum(PART_RATIO * gap, 0.5 * element)
        centers = corners.mean(axis=1)
        for point in points:
            rows = np.flatnonzero(np.linalg.norm(centers - point, axis=1) < 2.0 * longest)
            out[rows] |= longest[rows] > distance_to_triangles(point[None], corners[rows])[0]
        return out

    surface, parent = refine(whole.surface, too_large)
    return replace(whole, surface=surface, part=whole.part[parent])
