"""Closed shells lofted through sections: the aircraft's outline as triangles, without a mesh generator."""

from collections.abc import Sequence
from math import gamma

import numpy as np

from magsim.field.geometry.meshes import TriangleMesh

LEAST_AROUND = 12
"""Fewest points around a section."""

FINE = 4000
"""Points on a section from which its length is measured."""


def superellipse(count: int, half: tuple[float, float], exponent: float) -> np.ndarray:
    """Return a polygon of the area of ``|u/a|^e + |v/b|^e = 1``, its corners evenly spaced along the curve.

    Parameters
    ----------
    count : int
        Corners, a multiple of four; the first on the positive v axis, then towards positive u.
    half : (a, b) [m]
    exponent : float

    Returns
    -------
    (count, 2) [m]
    """
    a, b = half
    angle = np.linspace(0.0, 0.5 * np.pi, FINE)
    fine = np.column_stack([a * np.sin(angle) ** (2.0 / exponent), b * np.cos(angle) ** (2.0 / exponent)])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    even = np.linspace(0.0, along[-1], count // 4 + 1)
    quarter = np.column_stack([np.interp(even, along, fine[:, k]) for k in range(2)])
    quarter[0], quarter[-1] = (0.0, b), (a, 0.0)
    exact = 4.0 * a * b * gamma(1.0 + 1.0 / exponent) ** 2 / gamma(1.0 + 2.0 / exponent)
    return _of_area(_four_quarters(quarter), exact)


def ellipse(count: int, half: tuple[float, float]) -> np.ndarray:
    """Return a polygon of the area of an ellipse, finer at the ends of the long axis, (count, 2) [m].

    The first corner is on the positive u axis, then towards positive v.
    """
    angle = 2.0 * np.pi * np.arange(count // 4 + 1) / count
    quarter = np.column_stack([half[0] * np.cos(angle), half[1] * np.sin(angle)])
    turned = _four_quarters(quarter[:, ::-1])[:, ::-1]
    return _of_area(turned, np.pi * half[0] * half[1])


def _four_quarters(quarter: np.ndarray) -> np.ndarray:
    """Return an exactly symmetric closed polygon from its corners between the positive v and u axes."""
    right = np.concatenate([quarter, quarter[-2::-1] * (1.0, -1.0)])
    left = right[-2:0:-1] * (-1.0, 1.0)
    return np.concatenate([right, left])


def _of_area(corners: np.ndarray, area: float) -> np.ndarray:
    u, v = corners.T
    own = 0.5 * abs(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1)))
    return corners * np.sqrt(area / own)


def perimeter(half: tuple[float, float], exponent: float = 2.0) -> float:
    """Return the length of a superellipse [m]."""
    angle = np.linspace(0.0, 0.5 * np.pi, FINE)
    u, v = half[0] * np.sin(angle) ** (2.0 / exponent), half[1] * np.cos(angle) ** (2.0 / exponent)
    return float(4.0 * np.hypot(np.diff(u), np.diff(v)).sum())


def around(length: float, element: float) -> int:
    """Return the number of corners of a polygon for edges of about ``element``, a multiple of four."""
    return max(LEAST_AROUND, 4 * int(np.ceil(length / (4.0 * element) - 1e-9)))


def stations(table: np.ndarray, lengths: Sequence[float], element: float) -> np.ndarray:
    """Insert rows on straight lines between the given ones, so that no step is longer than ``element``.

    Parameters
    ----------
    table : (m, k)
        Numbers that describe each section.
    lengths : (m - 1,) [m]
        Length of the surface between a section and the next.
    element : float [m]

    Returns
    -------
    (p, k)
        The given rows are among them.
    """
    out = [table[:1]]
    for a, b, length in zip(table[:-1], table[1:], lengths, strict=True):
        steps = max(1, int(np.ceil(length / element - 1e-9)))
        out.append(a + (b - a) * np.arange(1, steps + 1)[:, None] / steps)
    return np.concatenate(out)


def loft(rings: np.ndarray, *, mirror: bool = False) -> TriangleMesh:
    """Return the closed surface through rings, with flat caps at both ends.

    Corner ``i`` of a ring and corner ``n - i`` lie opposite to each other in the ring's own mirror image, and all
    diagonals are mirrored with them: a symmetric shape gets a symmetric mesh.

    Parameters
    ----------
    rings : (m, n, 3) [m]
        ``n`` even.
    mirror : bool
        The first ring lies in the plane y = 0; the surface is continued through its mirror image.

    Returns
    -------
    TriangleMesh
        Normals point outward.
    """
    if mirror:
        rings = np.concatenate([rings[:0:-1] * (1.0, -1.0, 1.0), rings])
    count, size = rings.shape[:2]
    number = np.arange(count * size).reshape(count, size)
    ahead = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], ahead[:-1], ahead[1:], number[1:]
    flip = np.broadcast_to(np.arange(size) >= size // 2, a.shape).copy()
    if mirror:
        flip[: (count - 1) // 2] ^= True
    triangles = [_cut(a, b, c, d, flip)]
    vertices = [rings.reshape(-1, 3)]
    start = count * size
    half = size // 2
    for end, sign in ((0, -1), (count - 1, 1)):
        ring = number[end]
        middle = 0.5 * (rings[end, 1:half] + rings[end, :half:-1])
        spine = np.concatenate([[ring[0]], start + np.arange(half - 1), [ring[half]]])
        start += half - 1
        vertices.append(middle)
        sides = ring[: half + 1], np.roll(ring[::-1], 1)[: half + 1]
        caps = []
        for side, turned in zip(sides, (False, True), strict=True):
            quads = _cut(spine[:-1], side[:-1], side[1:], spine[1:], np.zeros(half, dtype=bool))
            caps.append(quads[:, ::-1] if turned else quads)
        faces = np.concatenate(caps)
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        triangles.append(faces if sign > 0 else faces[:, ::-1])
    points, faces = np.concatenate(vertices), np.concatenate(triangles)
    return TriangleMesh(points, faces if volume(points, faces) > 0.0 else faces[:, ::-1])


def _cut(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, flip: np.ndarray) -> np.ndarray:
    """Cut quadrangles a, b, c, d along a-c, or along b-d where ``flip``."""
    a, b, c, d, flip = (np.ravel(x) for x in (a, b, c, d, flip))
    first = np.where(flip[:, None], np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    second = np.where(flip[:, None], np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    return np.concatenate([first, second])


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Return the volume inside a closed surface, positive where its normals point outward [m^3]."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("tx,tx->", a, np.cross(b, c)) / 6.0)
