"""Meshes of steel parts: sizes in closed form, and the polarizability that weak material must have."""

import numpy as np
import pytest
import trimesh

from magsim.field.geometry.meshes import Tetrahedra, TriangleMesh, ball, boundary, cylinder
from magsim.field.geometry.soundness import check_surface
from magsim.field.metal.steel.induced import InducedModel, Sheet, Solid
from magsim.field.metal.steel.meshing import steel_parts
from magsim.field.metal.steel.shapes import graded, loft, mirrored, plate, strip, tube
from tests.support.steel_kinds import ALL_KINDS, steel

BENT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.5, 0.5, 0.0], [1.5, 0.5, 1.0]])
LENGTH = 2.0 + np.sqrt(0.5)
CHI = 1e-6


def _trimesh(surface: TriangleMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(surface.vertices, surface.triangles, process=False)


def _volume(mesh: Tetrahedra) -> float:
    return _trimesh(TriangleMesh(mesh.vertices, boundary(mesh))).volume


def test_graded_places_are_close_at_both_ends() -> None:
    steps = np.diff(graded(2.0, 0.3))
    assert steps.sum() == pytest.approx(2.0, rel=1e-14)
    assert 0.2 < steps.max() <= 0.3
    assert steps[0] == pytest.approx(steps[-1])
    assert steps[0] < 0.25 * steps.max()
    assert np.all(np.diff(steps[: len(steps) // 2]) > 0.0)


def test_plate() -> None:
    mesh = plate((1.0, 2.0, 3.0), (0.0, 0.6, 0.8), (1.0, 0.0, 0.0), (1.2, 0.9), 0.2)
    assert _trimesh(mesh).area == pytest.approx(1.2 * 0.9, rel=1e-13)
    arms = mesh.vertices - [1.0, 2.0, 3.0]
    np.testing.assert_allclose(arms @ [0.0, 0.6, 0.8], 0.0, atol=1e-14)
    assert np.ptp(arms @ [1.0, 0.0, 0.0]) == pytest.approx(1.2)
    # In-plane tensor of weak material: chi t A (I - n n), in every mesh.
    normal = np.array([0.0, 0.6, 0.8])
    alpha = InducedModel([Sheet(mesh, 0.001, CHI)]).moment() / (CHI * 0.001 * 1.08)
    np.testing.assert_allclose(alpha, np.eye(3) - np.outer(normal, normal), atol=2e-6)


def test_strip_keeps_its_width_around_bends_and_its_face() -> None:
    mesh = strip(BENT[:3], np.array([0.0, 0.0, 1.0]), 0.05, 0.1)
    assert _trimesh(mesh).area == pytest.approx(0.05 * (1.0 + np.sqrt(0.5)), rel=1e-13)
    np.testing.assert_allclose(mesh.vertices[:, 2], 0.0, atol=1e-15)
    upright = strip(BENT[:3], np.array([0.0, 1.0, 0.0]), 0.05, 0.1)
    assert np.ptp(upright.vertices[:, 2]) == pytest.approx(0.05)
    check_surface(mesh, closed=False)


@pytest.mark.parametrize("closed", [False, True])
def test_tube_has_the_wall_and_the_volume_of_its_polygon(closed: bool) -> None:
    mesh = tube(BENT, 0.0125, 12, 0.1, closed=closed)
    body = _trimesh(mesh)
    corner = 0.0125 * np.pi / (12 * np.sin(np.pi / 12))
    section = 6.0 * corner**2 * np.sin(np.pi / 6)
    assert body.area == pytest.approx(2.0 * np.pi * 0.0125 * LENGTH + 2.0 * section * closed, rel=1e-12)
    assert body.is_watertight == closed
    assert body.is_winding_consistent
    if closed:
        assert body.volume == pytest.approx(section * LENGTH, rel=1e-12)
    check_surface(mesh, closed=closed)


def test_loft_of_boxes_and_ellipses() -> None:
    line = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    bar = loft(line, np.array([[0.2, 0.05]] * 2), np.array([0.0, 0.0, 1.0]), 0.1)
    assert _volume(bar) == pytest.approx(0.02, rel=1e-12)
    assert np.ptp(bar.vertices[:, 2]) == pytest.approx(0.2)
    rod = loft(line, np.array([[0.2, 0.1]] * 2), np.array([0.0, 0.0, 1.0]), 0.1, round_section=True)
    assert _volume(rod) == pytest.approx(np.pi * 0.1 * 0.05 * 2.0, rel=1e-12)
    # A frustum: h (A + sqrt(A a) + a) / 3.
    taper = loft(line, np.array([[0.2, 0.1], [0.1, 0.05]]), np.array([0.0, 0.0, 1.0]), 0.05)
    assert _volume(taper) == pytest.approx(2.0 * (0.02 + 0.01 + 0.005) / 3.0, rel=1e-3)


def test_loft_that_folds_is_refused() -> None:
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.01, 0.03, 0.0]])
    with pytest.raises(ValueError, match="folds over itself"):
        boundary(loft(line, np.array([[0.2, 0.05]] * 3), np.array([0.0, 0.0, 1.0]), 0.05))


def test_boundary_is_closed_outward_and_whole() -> None:
    for mesh, volume in (
        (ball(2, [0.2, 0.5]), 4.0 / 3.0 * np.pi * 0.125),
        (cylinder((1.0, 0.0, 0.0), (0.0, 0.6, 0.8), radius=0.2, length=0.7, rings=3, layers=4), np.pi * 0.04 * 0.7),
    ):
        body = _trimesh(TriangleMesh(mesh.vertices, boundary(mesh)))
        assert body.is_watertight
        assert body.volume == pytest.approx(volume, rel=1e-12)


def test_a_mirrored_part_has_the_mirrored_response() -> None:
    mesh = loft(BENT[1:], np.array([[0.2, 0.1]] * 3), np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0), 0.2)
    flip = np.array([1.0, -1.0, 1.0])
    here, there = (InducedModel([Solid(m, 50.0)]) for m in (mesh, mirrored(mesh)))
    point = np.array([[0.5, -0.6, 0.3]])
    mirror = flip[:, None] * here.response(point)[0] * flip
    np.testing.assert_allclose(there.response(point * flip)[0], mirror, atol=1e-9 * np.abs(mirror).max())


@pytest.mark.parametrize("part", ALL_KINDS, ids=lambda part: part["kind"])
def test_weak_material_has_the_moment_of_its_volume(part: dict) -> None:
    """alpha = chi V for solids; chi t times the integral of the tangential projector for sheets."""
    for made in steel_parts(steel(part | {"mu_r": 1.0 + CHI})).values():
        alpha = InducedModel([made]).moment() / made.chi
        if isinstance(made, Solid):
            np.testing.assert_allclose(alpha, _volume(made.mesh) * np.eye(3), atol=2e-5 * np.abs(alpha).max())
        else:
            body = _trimesh(made.mesh)
            normal = body.face_normals
            flat = np.einsum("t,tij->ij", body.area_faces, np.eye(3) - normal[:, :, None] * normal[:, None, :])
            exact = made.thickness_m * flat
            np.testing.assert_allclose(alpha, exact, atol=2e-5 * np.abs(exact).max())
