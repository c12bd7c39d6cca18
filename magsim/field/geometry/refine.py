"""Finer triangles where they are needed, by bisection of longest edges; the surface itself does not change."""

from collections.abc import Callable

import numpy as np

from magsim.field.geometry.meshes import TriangleMesh

ROUNDS = 40
"""Most rounds of bisection: each halves the area, so forty are more than any mesh needs."""


def distance_to_triangles(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distance of each point from each triangle, (p, t) [m].

    Parameters
    ----------
    points : (p, 3) [m]
    corners : (t, 3, 3) [m]
    """
    edges = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inward = np.cross(normal[:, None], edges)
    out = np.empty((len(points), len(corners)))
    for row, point in enumerate(points):
        rays = point - corners
        along = np.einsum("tix,tix->ti", rays, edges) / np.einsum("tix,tix->ti", edges, edges)
        foot = rays - np.clip(along, 0.0, 1.0)[..., None] * edges
        to_edge = np.sqrt(np.einsum("tix,tix->ti", foot, foot).min(axis=1))
        above = np.all(np.einsum("tix,tix->ti", rays, inward) >= 0.0, axis=1)
        out[row] = np.where(above, np.abs(np.einsum("tx,tx->t", rays[:, 0], normal)), to_edge)
    return out


def refine(
    surface: TriangleMesh, too_large: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[TriangleMesh, np.ndarray]:
    """Bisect triangles until none is too large.

    The longest edge is cut first, and that of the neighbor before it where it is longer still, so that the mesh stays
    conforming and no angle falls below half of the smallest one (M.-C. Rivara, Int. J. Numer. Meth. Eng. 20, 745
    (1984)).

    Parameters
    ----------
    surface : TriangleMesh
    too_large : callable
        From corners (t, 3, 3) [m], and the given triangle (t,) int that each lies in, to (t,) bool.

    Returns
    -------
    surface : TriangleMesh
    parent : (t,) int
        The triangle of the given surface that each new one lies in.
    """
    vertices, triangles = surface.vertices, surface.triangles
    parent = np.arange(len(triangles))
    for _ in range(ROUNDS):
        flagged = too_large(vertices[triangles], parent)
        if not flagged.any():
            break
        vertices, triangles, rows = _bisect(vertices, triangles, flagged)
        parent = parent[rows]
    return TriangleMesh(vertices, triangles), parent


def _bisect(vertices: np.ndarray, triangles: np.ndarray, flagged: np.ndarray) -> tuple[np.ndarray, ...]:
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
    pairs, edge = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    length = np.linalg.norm(vertices[pairs[:, 1]] - vertices[pairs[:, 0]], axis=1)
    # One order of all edges, so that two triangles never wait for each other.
    rank = np.empty(len(pairs), dtype=int)
    rank[np.lexsort((np.arange(len(pairs)), np.round(length, 9)))] = np.arange(len(pairs))
    longest = np.argmax(rank[edge], axis=1)
    cut = np.zeros(len(pairs), dtype=bool)
    first = edge[np.arange(len(edge)), longest]
    cut[first[flagged]] = True
    while True:
        touched = cut[edge].any(axis=1) & ~cut[first]
        if not touched.any():
            break
        cut[first[touched]] = True
    middle = np.full(len(pairs), -1)
    middle[cut] = len(vertices) + np.arange(np.count_nonzero(cut))
    turn = (longest[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    ab, bc, ca = middle[np.take_along_axis(edge, turn, axis=1)].T
    rows = np.arange(len(triangles))
    pieces = []
    for choice, corners in (
        (ab < 0, [(a, b, c)]),
        ((ab >= 0) & (ca < 0), [(a, ab, c)]),
        ((ab >= 0) & (ca >= 0), [(a, ab, ca), (ab, c, ca)]),
        ((ab >= 0) & (bc < 0), [(ab, b, c)]),
        ((ab >= 0) & (bc >= 0), [(ab, b, bc), (ab, bc, c)]),
    ):
        pieces += [(np.column_stack(piece)[choice], rows[choice]) for piece in corners]
    vertices = np.concatenate([vertices, 0.5 * (vertices[pairs[cut, 0]] + vertices[pairs[cut, 1]])])
    return vertices, np.concatenate([p for p, _ in pieces]), np.concatenate([r for _, r in pieces])
