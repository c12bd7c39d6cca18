"""Meshes that may not be magnetized are refused with place and remedy; sound ones pass."""

import numpy as np
import pytest

from magsim.field.geometry.meshes import TriangleMesh, box_surface, icosphere
from magsim.field.geometry.soundness import check_surface, first_touch, point_triangle, triangle_distance, winding

SPHERE = icosphere(2, 0.5)


def _joined(*surfaces: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces)])
    triangles = [s.triangles + start for s, start in zip(surfaces, starts, strict=False)]
    return TriangleMesh(np.vstack([s.vertices for s in surfaces]), np.vstack(triangles))


def _moved(surface: TriangleMesh, *step: float) -> TriangleMesh:
    return TriangleMesh(surface.vertices + np.array(step), surface.triangles)


def _flipped(surface: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(surface.vertices, surface.triangles[:, ::-1].copy())


def _one_flipped() -> TriangleMesh:
    triangles = SPHERE.triangles.copy()
    triangles[7] = triangles[7, ::-1]
    return TriangleMesh(SPHERE.vertices, triangles)


def _corner_through() -> TriangleMesh:
    vertices = SPHERE.vertices.copy()
    vertices[10] *= -1.3
    return TriangleMesh(vertices, SPHERE.triangles)


def _flat_triangle() -> TriangleMesh:
    vertices = SPHERE.vertices.copy()
    a, b, c = SPHERE.triangles[0]
    vertices[a] = 0.5 * (vertices[b] + vertices[c])
    return TriangleMesh(vertices, SPHERE.triangles)


FOLDED = TriangleMesh(np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0.6, 0]]), np.array([[0, 1, 2], [1, 0, 3]]))
FIN = TriangleMesh(
    np.vstack([box_surface((0, 0, 0), (1, 1, 1), 1.0).vertices, [[0.0, 0.0, 2.0]]]),
    np.vstack([box_surface((0, 0, 0), (1, 1, 1), 1.0).triangles, [[0, 1, 8]]]),
)
SOUND = {
    "sphere": SPHERE,
    "box": box_surface((1.0, 2.0, 3.0), (1.0, 0.8, 0.6), 0.2),
    "two spheres": _joined(SPHERE, _moved(SPHERE, 1.1, 0.0, 0.0)),
    "hollow sphere": _joined(SPHERE, _flipped(icosphere(2, 0.3))),
}
BAD = {
    "open": (TriangleMesh(SPHERE.vertices, SPHERE.triangles[3:]), r"is open: \d+ edges, the first at \("),
    "one triangle inward": (_one_flipped(), "turned partly inward: 3 edges"),
    "fin": (FIN, "is open: 2 edges"),
    "spheres that cross": (_joined(SPHERE, _moved(SPHERE, 0.6, 0.0, 0.0)), r"crosses or touches itself near \("),
    "corner through the other side": (_corner_through(), "crosses or touches itself"),
    "flat triangle": (_flat_triangle(), "has degenerate triangles, 1 of them, the first at"),
    "twice": (
        TriangleMesh(SPHERE.vertices, np.vstack([SPHERE.triangles, SPHERE.triangles[:1]])),
        "same triangle twice at",
    ),
    "sphere in a sphere": (_joined(SPHERE, icosphere(2, 0.3)), "turned the wrong way or lies in another"),
    "one of two inward": (_joined(SPHERE, _flipped(_moved(SPHERE, 1.1, 0.0, 0.0))), "turned the wrong way"),
}


@pytest.mark.parametrize("name", SOUND)
def test_sound_closed_meshes_pass(name: str) -> None:
    assert check_surface(SOUND[name], closed=True) is SOUND[name]


@pytest.mark.parametrize("name", BAD)
def test_bad_closed_meshes_are_told(name: str) -> None:
    surface, text = BAD[name]
    with pytest.raises(ValueError, match=text) as caught:
        check_surface(surface, closed=True)
    assert "allowed: " in str(caught.value)


def test_a_mesh_that_is_inside_out_as_a_whole_is_turned() -> None:
    for name in ("sphere", "hollow sphere"):
        turned = check_surface(_flipped(SOUND[name]), closed=True)
        np.testing.assert_array_equal(turned.triangles, SOUND[name].triangles)


def test_a_sheet_may_be_open_but_not_folded() -> None:
    check_surface(TriangleMesh(SPHERE.vertices, SPHERE.triangles[3:]), closed=False)
    check_surface(_one_flipped(), closed=False)
    with pytest.raises(ValueError, match="crosses or touches itself"):
        check_surface(FOLDED, closed=False)


def test_distances_of_triangles_against_a_dense_search() -> None:
    rng = np.random.default_rng(3)
    first, second = rng.normal(size=(60, 3, 3)), rng.normal(size=(60, 3, 3)) + rng.normal(size=(60, 1, 3))
    got = triangle_distance(first, second)
    grid = np.array([(i, j, 40 - i - j) for i in range(41) for j in range(41 - i)]) / 40.0
    for a, b, distance in zip(first, second, got, strict=True):
        x, y = grid @ a, grid @ b
        searched = min(float(np.linalg.norm(x[:, None] - part, axis=2).min()) for part in np.array_split(y, 4))
        edge = max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max())
        assert distance <= searched + 1e-12
        assert searched - distance < 0.08 * edge


def test_distance_of_a_point_from_a_triangle() -> None:
    corners = np.broadcast_to(np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]), (4, 3, 3))
    points = np.array([[0.5, 0.5, 3.0], [-3.0, -4.0, 0.0], [1.0, -2.0, 0.0], [2.0, 2.0, 1.0]])
    np.testing.assert_allclose(point_triangle(points, corners), [3.0, 5.0, 2.0, np.sqrt(3.0)])


def test_parts_that_touch_or_nearly_do() -> None:
    here = SPHERE.vertices[SPHERE.triangles]
    assert first_touch(here, here + np.array([0.9, 0.0, 0.0]))[1] == 0.0
    place, distance = first_touch(here, here + np.array([1.001, 0.0, 0.0]))
    assert distance == pytest.approx(0.001, abs=1e-9)
    np.testing.assert_allclose(place, [0.5, 0.0, 0.0], atol=0.15)
    assert first_touch(here, here + np.array([1.02, 0.0, 0.0])) is None
    # A box in a box does not touch.
    assert first_touch(here, 0.2 * here) is None


def test_winding() -> None:
    hollow = SOUND["hollow sphere"]
    corners = hollow.vertices[hollow.triangles]
    points = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.6, 0.0, 0.0]])
    np.testing.assert_array_equal(winding(corners, points), [0, 1, 0])
