"""Meshes of an aircraft's steel parts: flat sheets, strips and tubes along a line, bars and lofts.

The charge of a sheet is singular at its open edges, so sheets are graded toward them: nodes at equal steps of the
angle whose cosine they are, which restores the second order that equal elements lose.
"""

import itertools
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh, disc_grid, extrude

Mesh = TypeVar("Mesh", TriangleMesh, Tetrahedra)

LIMIT = 65_536
"""Most vertices of a part; the cost grows with the cube of the triangles long before."""


def graded(length: float, element: float) -> np.ndarray:
    """Return places from 0 to ``length``, close at both ends and nowhere farther apart than ``element``."""
    count = max(2, int(np.ceil(0.5 * np.pi * length / element - 1e-9)))
    _check_count(count)
    return 0.5 * length * (1.0 - np.cos(np.pi * np.arange(count + 1) / count))


def _check_count(count: float) -> None:
    if count > LIMIT:
        msg = f"would have a mesh of more than {LIMIT} points; allowed: larger elements"
        raise ValueError(msg)


def grid_triangles(rows: int, columns: int, *, closed: bool = False) -> np.ndarray:
    """Return the triangles of a grid of ``rows x columns`` points; ``closed``: the last column meets the first."""
    number = np.arange(rows * columns).reshape(rows, columns)
    if closed:
        number = np.column_stack([number, number[:, 0]])
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def plate(
    center: Sequence[float], normal: Sequence[float], along: Sequence[float], size: Sequence[float], element: float
) -> TriangleMesh:
    """Return a flat rectangle.

    Parameters
    ----------
    center : (3,) [m]
    normal, along : (3,)
        Unit vectors: across the plate, and along its first side.
    size : (2,) [m]
        First side and the other.
    element : float [m]
        Largest leg of a triangle.
    """
    first, second = np.asarray(along, dtype=float), np.cross(normal, along)
    u, v = graded(size[0], element) - 0.5 * size[0], graded(size[1], element) - 0.5 * size[1]
    _check_count(len(u) * len(v))
    points = np.asarray(center) + u[:, None, None] * first + v[None, :, None] * second
    return TriangleMesh(points.reshape(-1, 3), grid_triangles(len(u), len(v)))


def _stations(points: np.ndarray, element: float, *, fine_ends: bool) -> list[np.ndarray]:
    """Return for each piece of a polyline the shares at which it has a section, from 0 to 1, both included."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    stops = np.concatenate([[0.0], np.cumsum(lengths)])
    total, out = stops[-1], []
    _check_count(total / element)
    for start, stop in itertools.pairwise(stops):
        if fine_ends:
            low, high = (np.arccos(np.clip(1.0 - 2.0 * s / total, -1.0, 1.0)) for s in (start, stop))
            count = max(1, int(np.ceil((high - low) * 0.5 * total / element - 1e-9)))
            places = 0.5 * total * (1.0 - np.cos(np.linspace(low, high, count + 1)))
            out.append(np.clip((places - start) / (stop - start), 0.0, 1.0))
        else:
            count = max(1, int(np.ceil((stop - start) / element - 1e-9)))
            out.append(np.linspace(0.0, 1.0, count + 1))
        out[-1][[0, -1]] = 0.0, 1.0
    return out


def directions(points: np.ndarray) -> np.ndarray:
    """Return the unit vectors along the pieces of a polyline, (k, 3)."""
    steps = np.diff(points, axis=0)
    return steps / np.linalg.norm(steps, axis=1, keepdims=True)


def _turn(start: np.ndarray, stop: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn vectors (..., 3) by the smallest rotation from one unit vector to another."""
    axis, cos = np.cross(start, stop), float(start @ stop)
    along = np.einsum("...x,x->...", vectors, axis)[..., None]
    return cos * vectors + np.cross(axis, vectors) + along * axis / (1.0 + cos)


def sweep(profile: np.ndarray, points: np.ndarray, facing: np.ndarray, element: float) -> np.ndarray:
    """Sweep a profile along a polyline, mitered at its corners.

    Parameters
    ----------
    profile : (m, 2) [m]
        Sideways, and toward ``facing``.
    points : (k, 3) [m]
    facing : (3,)
        At the first point; made perpendicular to the first piece, and turned with the line from there.
    element : float [m]
        Largest distance of two sections; they are closer toward both ends.

    Returns
    -------
    (sections, m, 3) [m]
    """
    ways = directions(points)
    up = np.asarray(facing, dtype=float)
    up = up - (up @ ways[0]) * ways[0]
    up /= np.linalg.norm(up)
    frame = np.stack([np.cross(up, ways[0]), up])
    stations, sections = _stations(points, element, fine_ends=True), []
    for piece, way in enumerate(ways):
        if piece:
            frame = _turn(ways[piece - 1], way, frame)
        flat = profile @ frame
        ends = []
        for corner, other in ((piece, piece - 1), (piece + 1, piece + 1)):
            miter = way + (ways[other] if 0 <= other < len(ways) else way)
            lean = np.einsum("mx,x->m", flat, miter) / (way @ miter)
            ends.append(points[corner] + flat - lean[:, None] * way)
        shares = stations[piece][1 if piece else 0 :, None, None]
        sections.append((1.0 - shares) * ends[0] + shares * ends[1])
    return np.concatenate(sections)


def strip(points: np.ndarray, facing: np.ndarray, width: float, element: float) -> TriangleMesh:
    """Return a flat strip along a polyline, its face toward ``facing``, at least four elements wide."""
    sides = graded(width, min(element, 0.4 * width)) - 0.5 * width
    profile = np.column_stack([sides, np.zeros_like(sides)])
    sections = sweep(profile, points, facing, element)
    _check_count(sections.size / 3)
    return TriangleMesh(sections.reshape(-1, 3), grid_triangles(*sections.shape[:2]))


def tube(points: np.ndarray, radius: float, sides: int, element: float, *, closed: bool) -> TriangleMesh:
    """Return a round tube along a polyline as a prism of the same circumference; ``closed``: with end discs."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    corner = radius * np.pi / (sides * np.sin(np.pi / sides))
    profile = corner * np.column_stack([np.cos(angle), np.sin(angle)])
    facing = np.eye(3)[np.argmin(np.abs(directions(points)[0]))]
    sections = sweep(profile, points, facing, element)
    count = sections.shape[0] * sides
    _check_count(count)
    vertices, triangles = sections.reshape(-1, 3), grid_triangles(len(sections), sides, closed=True)
    if closed:
        ring = np.arange(sides)
        following = np.roll(ring, -1)
        first = np.column_stack([np.full(sides, count), ring, following])
        last = np.column_stack([np.full(sides, count + 1), following, ring])
        last[:, 1:] += count - sides
        vertices = np.vstack([vertices, points[0], points[-1]])
        triangles = np.concatenate([triangles, first, last])
    return TriangleMesh(vertices, triangles[:, ::-1].copy())


def rectangle_grid(across: int, up: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a square from -1/2 to 1/2 in both directions: points (n, 2), triangles (t, 3)."""
    u, v = np.linspace(-0.5, 0.5, across + 1), np.linspace(-0.5, 0.5, up + 1)
    points = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    return points, grid_triangles(across + 1, up + 1)


def loft(
    centers: np.ndarray, sizes: np.ndarray, across: np.ndarray, element: float, *, round_section: bool = False
) -> Tetrahedra:
    """Return the solid through rectangles or ellipses: a bar of two sections, a bent and tapered leg of more.

    Parameters
    ----------
    centers : (k, 3) [m]
    sizes : (k, 2) [m]
        Extent along ``across``, and perpendicular to it and to the line of centers.
    across : (3,)
        Unit vector; made perpendicular to the line at each section, which halves the angle of the line there.
    element : float [m]
        Largest step along the line, and of the larger extent of the sections.
    round_section : bool
        Ellipses of the exact area instead of rectangles.
    """
    largest = sizes.max(axis=0)
    counts = [max(2, int(np.ceil(extent / element - 1e-9))) for extent in largest]
    _check_count(counts[0] * counts[1])
    flat, triangles = disc_grid(max(2, -(-max(counts) // 2)), 0.5) if round_section else rectangle_grid(*counts)
    ways, sections = directions(centers), []
    for number, center in enumerate(centers):
        along = ways[max(number - 1, 0)] + ways[min(number, len(ways) - 1)]
        along /= np.linalg.norm(along)
        side = across - (across @ along) * along
        side /= np.linalg.norm(side)
        scaled = flat * sizes[number]
        sections.append(center + scaled[:, :1] * side + scaled[:, 1:] * np.cross(along, side))
    shares = _stations(centers, element, fine_ends=False)
    filled = [sections[0][None]]
    for piece, share in enumerate(shares):
        part = share[1:, None, None]
        filled.append((1.0 - part) * sections[piece] + part * sections[piece + 1])
    stack = np.concatenate(filled)
    _check_count(stack.size / 3)
    return extrude(stack, triangles)


def mirrored(mesh: Mesh) -> Mesh:
    """Return the mesh on the other side of the plane y = 0."""
    vertices = mesh.vertices * np.array([1.0, -1.0, 1.0])
    if isinstance(mesh, TriangleMesh):
        return TriangleMesh(vertices, mesh.triangles[:, ::-1].copy())
    return Tetrahedra(vertices, mesh.cells, mesh.layer)
