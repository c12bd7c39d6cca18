"""Joints of a skin: where they lie on its mesh, and what they do there."""

import numpy as np
import pytest
from pydantic import ValidationError

from magsim.aircraft.magnetics import Skin
from magsim.field.metal.skin.mesh import graded, outline
from magsim.field.metal.skin.model import compute_skin, seam_edges, shells_of

PLACE = np.array([[0.0, 0.35, 0.3]])


def _skin(**seams: object) -> Skin:
    hull = {
        "kind": "body",
        "name": "hull",
        "conductivity_spm": 1.7e7,
        "thickness_m": 0.001,
        "sections": [{"x_m": x, "width_m": 0.6, "height_m": 0.4, "z_m": 0.6} for x in (1.0, 0.2, -1.0)],
        "source": "a test",
    }
    wing = {
        "kind": "panel",
        "name": "wing",
        "span": "right",
        "conductivity_spm": 1.7e7,
        "thickness_m": 0.001,
        "sections": [{"at_m": y, "leading_edge_m": 0.5, "chord_m": 1.0, "depth_m": 0.2} for y in (0.0, 1.3, 2.0)],
        "source": "a test",
    }
    fin = {
        "kind": "panel",
        "name": "fin",
        "span": "up",
        "conductivity_spm": 1.7e7,
        "thickness_m": 0.001,
        "sections": [{"at_m": z, "leading_edge_m": -1.5, "chord_m": 0.8, "depth_m": 0.1} for z in (-0.3, -0.9, -1.4)],
        "source": "a test",
    }
    parts = [
        part | ({"seams_ohm_m": seams[part["name"]]} if part["name"] in seams else {}) for part in (hull, wing, fin)
    ]
    return Skin.model_validate({"element_m": 0.4, "parts": parts})


def test_a_joint_runs_once_around_its_section() -> None:
    """One on the hull, the root of the wing and one on each side, one on the fin; the mesh is finer near PLACE."""
    skin = _skin(hull=[1e-6], wing=[2e-6, 3e-6], fin=[4e-6])
    mesh = graded(outline(skin), skin.element_m, PLACE)
    seams = seam_edges(skin, mesh.surface, mesh.part)
    ends = mesh.surface.vertices[seams.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    for ohm_m, axis, places, around in (
        (1e-6, 0, [0.2], [1.58]),
        (2e-6, 1, [0.0], [2.10]),
        (3e-6, 1, [-1.3, 1.3], [2.10, 2.10]),
        (4e-6, 2, [-0.9], [1.63]),
    ):
        on = seams.ohm_m == ohm_m
        at = ends[on][:, 0, axis]
        np.testing.assert_allclose(np.unique(np.round(at, 9)), places)
        for place, length in zip(places, around, strict=True):
            mine = on & (np.abs(ends[:, 0, axis] - place) < 1e-9)
            assert lengths[mine].sum() == pytest.approx(length, rel=0.05)  # a polygon for an ellipse
            # a closed line: each of its nodes has two of its edges
            assert set(np.unique(seams.edges[mine], return_counts=True)[1]) == {2}


def test_joints_shorten_the_answer_of_what_crosses_them_alone() -> None:
    """Around the hull's own axis currents run along its joint; around the other two they cross it."""
    plain = shells_of(_skin(), PLACE)
    jointed = shells_of(_skin(hull=[1.0]), PLACE)
    assert not len(plain.seams.ohm_m)
    assert (jointed.resistance - plain.resistance).nnz > 0
    flow = {name: compute_skin(skin, PLACE).drive for name, skin in (("plain", _skin()), ("cut", _skin(hull=[1.0])))}
    moment = {name: (drive**2).sum(axis=0) for name, drive in flow.items()}
    assert moment["cut"][0] == pytest.approx(moment["plain"][0], rel=1e-3)
    assert np.all(moment["cut"][1:] < 0.97 * moment["plain"][1:])


def test_joints_need_a_number_each() -> None:
    with pytest.raises(ValidationError, match="2 seams_ohm_m; allowed: none, or one for each joint, 1"):
        _skin(hull=[1e-6, 1e-6])
    with pytest.raises(ValidationError, match="greater than or equal to 0"):
        _skin(hull=[-1e-6])
