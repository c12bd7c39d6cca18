"""What a mesh must be before it is magnetized: no flat or double triangles, no crossings, closed where a body is.

Faults raise ``ValueError`` with the place and a remedy; the caller puts the part's name before it.
"""

from collections.abc import Iterator

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from magsim.field.geometry.meshes import TriangleMesh
from magsim.field.geometry.panels import Panels, solid_angle

SLIVER = 1e-3
"""Height of a triangle over its longest edge below which it counts as degenerate."""

TOUCH = 0.02
"""Distance of two parts over the smaller element below which they count as touching."""

MEET = 1e-6
"""The same for triangles of one mesh that share no corner."""

_CHUNK = 20_000


def element_sizes(corners: np.ndarray) -> np.ndarray:
    """Return the size of each triangle: its middle edge, the longer leg of a right one, (t,) [m]."""
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    return np.sort(edges, axis=1)[:, 1]


def place(point: np.ndarray) -> str:
    """Return a place as text for messages."""
    return "({:.4g}, {:.4g}, {:.4g}) m".format(*(float(x) + 0.0 for x in point))


def check_surface(surface: TriangleMesh, *, closed: bool) -> TriangleMesh:
    """Check a surface that is to be magnetized; a closed one that is inside out is turned outward.

    Raises
    ------
    ValueError
        If it has triangles that are degenerate or double, crosses itself, or shall be closed and is not, or is turned
        partly inward.
    """
    corners = surface.vertices[surface.triangles]
    _check_triangles(surface.triangles, corners)
    if closed:
        _check_closed(surface)
    for first, second in _pairs(corners, corners, 0.0, same=True):
        _check_pairs(surface.triangles, corners, first, second)
    if closed and _inside_out(surface, corners):
        return TriangleMesh(surface.vertices, surface.triangles[:, ::-1].copy())
    return surface


def _check_triangles(triangles: np.ndarray, corners: np.ndarray) -> None:
    panels = Panels(corners)
    bad = np.flatnonzero(2.0 * panels.areas <= SLIVER * panels.lengths.max(axis=1) ** 2)
    if len(bad):
        where = place(corners[bad[0]].mean(axis=0))
        msg = (
            f"has degenerate triangles, {len(bad)} of them, the first at {where}; allowed: triangles at least "
            f"{SLIVER:g} as high as long; merge their corners or mesh again"
        )
        raise ValueError(msg)
    _, first, count = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True)
    if count.max() > 1:
        where = place(corners[first[np.argmax(count > 1)]].mean(axis=0))
        msg = f"has the same triangle twice at {where}; allowed: each once; remove one"
        raise ValueError(msg)


def _check_closed(surface: TriangleMesh) -> None:
    edges = np.concatenate([surface.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    keys = np.sort(edges, axis=1)
    unique, owner, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    sense = np.bincount(owner.ravel(), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    for bad, what, remedy in (
        (count == 1, "is open", "fill the holes, or declare it as body = 'sheet' with thickness_m"),
        (count > 2, "has edges of more than two triangles", "separate the bodies that meet there"),
        (sense != 0.0, "is turned partly inward", "make all triangles outward"),
    ):
        if np.any(bad):
            where = surface.vertices[unique[np.argmax(bad)]].mean(axis=0)
            found = f"{np.count_nonzero(bad)} edges, the first at {place(where)}"
            msg = f"{what}: {found}; allowed: a closed surface; {remedy}"
            raise ValueError(msg)


def _inside_out(surface: TriangleMesh, corners: np.ndarray) -> bool:
    """Return whether a closed surface is inside out, by how often it winds around places beside each piece."""
    edges = np.concatenate([surface.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    count = len(surface.vertices)
    graph = sparse.csr_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    pieces = connected_components(graph, directed=False)[1][surface.triangles[:, 0]]
    panels = Panels(corners)
    largest = np.array([rows[np.argmax(panels.areas[rows])] for rows in _groups(pieces)])
    step = 0.01 * np.sqrt(panels.areas[largest])[:, None] * panels.normals[largest]
    behind, ahead = (winding(corners, panels.centroids[largest] + sign * step) for sign in (-1.0, 1.0))
    if np.all(behind == 1) and np.all(ahead == 0):
        return False
    if np.all(behind == 0) and np.all(ahead == -1):
        return True
    bad = int(np.flatnonzero((behind != 1) | (ahead != 0))[0])
    msg = (
        f"has a piece near {place(panels.centroids[largest[bad]])} that is turned the wrong way or lies in another; "
        "allowed: outer surfaces turned outward, hollows inward; reverse its triangles or remove it"
    )
    raise ValueError(msg)


def _groups(labels: np.ndarray) -> list[np.ndarray]:
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)


def winding(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how often closed triangles (t, 3, 3) wind around points (p, 3): 1 inside, 0 outside, (p,) int."""
    panels = Panels(corners)
    turns = [solid_angle(panels, point[None]).sum() for point in points]
    return -np.rint(np.array(turns) / (4.0 * np.pi)).astype(int)


def _pairs(
    first: np.ndarray, second: np.ndarray, margin: float, *, same: bool = False
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield pairs of triangles whose boxes come within ``margin``; ``same``: each pair of one mesh once."""
    low, high = first.min(axis=1) - margin, first.max(axis=1) + margin
    low2, high2 = second.min(axis=1), second.max(axis=1)
    step = max(1, 2_000_000 // len(second))
    for start in range(0, len(first), step):
        rows = slice(start, start + step)
        meet = np.ones((len(low[rows]), len(second)), dtype=bool)
        for axis in range(3):
            meet &= low[rows, None, axis] <= high2[None, :, axis]
            meet &= high[rows, None, axis] >= low2[None, :, axis]
        if same:
            meet &= np.arange(len(second)) > np.arange(len(first))[rows, None]
        i, j = np.nonzero(meet)
        for at in range(0, len(i), _CHUNK):
            yield i[at : at + _CHUNK] + start, j[at : at + _CHUNK]


def _check_pairs(triangles: np.ndarray, corners: np.ndarray, first: np.ndarray, second: np.ndarray) -> None:
    """Refuse triangles of one mesh that meet anywhere but in the corners that they share."""
    shared = (triangles[first][:, :, None] == triangles[second][:, None, :]).any(axis=2)
    number = shared.sum(axis=1)
    size = np.minimum(element_sizes(corners[first]), element_sizes(corners[second]))
    apart = np.full(len(first), np.inf)
    for count, distance in ((0, _whole_distance), (1, _edge_distance), (2, _corner_distance)):
        rows = np.flatnonzero(number == count)
        if len(rows):
            apart[rows] = distance(triangles, corners, first[rows], second[rows])
    bad = np.flatnonzero(apart < MEET * size)
    if len(bad):
        where = 0.5 * (corners[first[bad[0]]].mean(axis=0) + corners[second[bad[0]]].mean(axis=0))
        msg = (
            f"crosses or touches itself near {place(where)}; allowed: triangles that meet only in common edges and "
            "corners; merge its pieces there, or move them apart"
        )
        raise ValueError(msg)


def _whole_distance(triangles: np.ndarray, corners: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    del triangles
    return triangle_distance(corners[first], corners[second])


def _edge_distance(triangles: np.ndarray, corners: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distances of triangles with a common corner: from the opposite edge to the other, both ways."""
    out = np.full(len(first), np.inf)
    for one, other in ((first, second), (second, first)):
        common = (triangles[one][:, :, None] == triangles[other][:, None, :]).any(axis=2).argmax(axis=1)
        pick, rows = corners[one], np.arange(len(one))
        start, stop = pick[rows, (common + 1) % 3], pick[rows, (common + 2) % 3]
        out = np.minimum(out, _segment_triangle(start, stop, corners[other]))
    return out


def _corner_distance(triangles: np.ndarray, corners: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distances of triangles with a common edge: from the third corner to the other, both ways."""
    out = np.full(len(first), np.inf)
    for one, other in ((first, second), (second, first)):
        common = (triangles[one][:, :, None] == triangles[other][:, None, :]).any(axis=2)
        third = corners[one][np.arange(len(one)), np.argmin(common, axis=1)]
        out = np.minimum(out, point_triangle(third, corners[other]))
    return out


def point_triangle(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances of points (k, 3) from triangles (k, 3, 3), one to one, (k,) [m]."""
    edges = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(edges[:, 0], edges[:, 1])
    square = np.einsum("kx,kx->k", normal, normal)
    rays = points[:, None, :] - corners
    height = np.einsum("kx,kx->k", rays[:, 0], normal) / np.sqrt(square)
    inside = np.einsum("kix,kx->ki", np.cross(edges, rays), normal).min(axis=1) >= 0.0
    share = np.einsum("kix,kix->ki", rays, edges) / np.einsum("kix,kix->ki", edges, edges)
    foot = rays - np.clip(share, 0.0, 1.0)[..., None] * edges
    return np.where(inside, np.abs(height), np.linalg.norm(foot, axis=2).min(axis=1))


def _segments(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return the distances of segments p-q and r-s, one to one (Ericson, Real-Time Collision Detection, 5.1.9)."""
    d1, d2, ray = q - p, s - r, p - r
    a, e, f = (np.einsum("kx,kx->k", x, y) for x, y in ((d1, d1), (d2, d2), (d2, ray)))
    c, b = np.einsum("kx,kx->k", d1, ray), np.einsum("kx,kx->k", d1, d2)
    below = a * e - b * b
    first = np.clip(np.where(below > 1e-12 * a * e, (b * f - c * e) / np.where(below > 0, below, 1.0), 0.0), 0.0, 1.0)
    second = np.clip((b * first + f) / e, 0.0, 1.0)
    first = np.clip((b * second - c) / a, 0.0, 1.0)
    return np.linalg.norm(ray + first[:, None] * d1 - second[:, None] * d2, axis=1)


def _segment_triangle(start: np.ndarray, stop: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances of segments from triangles, one to one; zero where they cross."""
    edges = np.roll(corners, -1, axis=1) - corners
    normal, way = np.cross(edges[:, 0], edges[:, 1]), stop - start
    near = np.einsum("kx,kx->k", start - corners[:, 0], normal)
    far = np.einsum("kx,kx->k", stop - corners[:, 0], normal)
    share = near / np.where(near != far, near - far, 1.0)
    hit = start + share[:, None] * way
    inside = np.einsum("kix,kx->ki", np.cross(edges, hit[:, None] - corners), normal).min(axis=1) >= 0.0
    out = np.minimum(point_triangle(start, corners), point_triangle(stop, corners))
    for i in range(3):
        out = np.minimum(out, _segments(start, stop, corners[:, i], corners[:, (i + 1) % 3]))
    return np.where((near * far < 0.0) & inside, 0.0, out)


def triangle_distance(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the distances of triangles (k, 3, 3), one to one, (k,) [m]; zero where they cross."""
    out = np.full(len(first), np.inf)
    for i in range(3):
        out = np.minimum(out, _segment_triangle(first[:, i], first[:, (i + 1) % 3], second))
        out = np.minimum(out, _segment_triangle(second[:, i], second[:, (i + 1) % 3], first))
    return out


def first_touch(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return place and distance where two parts come closer than a small share of an element, or None.

    Parameters
    ----------
    first, second : (t, 3, 3) [m]
        Triangles of the two.
    """
    sizes, others = element_sizes(first), element_sizes(second)
    for i, j in _pairs(first, second, TOUCH * max(sizes.max(), others.max())):
        apart = triangle_distance(first[i], second[j])
        bad = np.flatnonzero(apart < TOUCH * np.minimum(sizes[i], others[j]))
        if len(bad):
            k = bad[0]
            return 0.5 * (first[i[k]].mean(axis=0) + second[j[k]].mean(axis=0)), float(apart[k])
    return None
