"""Files of triangles: three formats, joined corners, and nothing read but the bytes."""

import numpy as np
import pytest
import trimesh

from magsim.field.geometry.meshes import TriangleMesh, icosphere
from magsim.field.geometry.meshfile import MAX_TRIANGLES, placed, read_surface
from magsim.field.geometry.soundness import check_surface
from tests.support.exported import exported

SPHERE = icosphere(2, 0.5)


@pytest.mark.parametrize(("kind", "form"), [("stl", "stl"), ("stl_ascii", "stl"), ("ply", "ply"), ("obj", "obj")])
def test_formats(kind: str, form: str) -> None:
    surface = read_surface(exported(kind, SPHERE), form)
    assert len(surface.triangles) == 320
    assert len(surface.vertices) == 162
    check_surface(surface, closed=True)
    body = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert body.volume == pytest.approx(trimesh.Trimesh(SPHERE.vertices, SPHERE.triangles).volume, rel=1e-6)


def test_ascii_ply() -> None:
    assert len(read_surface(exported("ply", SPHERE, encoding="ascii"), "ply").triangles) == 320


GARBAGE = {
    "nothing": b"",
    "text": b"this is not a mesh\n" * 20,
    "zeros": bytes(200),
    "cut off": exported("stl", SPHERE)[:900],
    "huge count": b"\0" * 80 + b"\xff\xff\xff\xff" + bytes(100),
    "ply of a trillion": b"ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\nend_header\n1\n",
    "ply without faces": b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    b"property float z\nend_header\n0 0 0\n",
    "corners that are not there": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "not a number": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
}


@pytest.mark.parametrize("name", GARBAGE)
@pytest.mark.parametrize("kind", ["stl", "ply", "obj"])
def test_garbage_is_refused_in_one_line(kind: str, name: str) -> None:
    with pytest.raises(ValueError, match=r"cannot be read|holds no triangles|has corners") as caught:
        read_surface(GARBAGE[name], kind)
    assert "\n" not in str(caught.value)


def test_too_many_triangles() -> None:
    fine = icosphere(5, 0.5)
    assert len(fine.triangles) > MAX_TRIANGLES
    with pytest.raises(ValueError, match=r"has 20480 triangles; allowed: up to 6000"):
        read_surface(exported("stl", fine), "stl")


def test_what_a_file_names_is_not_opened(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An OBJ may name a library of materials, with pictures; neither is looked for."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret.mtl").write_text("newmtl a\nmap_Kd secret.png\n")
    opened = []
    real = open
    monkeypatch.setattr("builtins.open", lambda *a, **k: opened.append(a[0]) or real(*a, **k))
    content = b"mtllib secret.mtl\nusemtl a\n" + exported("obj", SPHERE)
    assert len(read_surface(content, "obj").triangles) == 320
    assert not [name for name in opened if "secret" in str(name)]


def test_units_and_axes() -> None:
    surface = TriangleMesh(np.array([[1000.0, 200.0, 30.0]]), np.zeros((1, 3), dtype=int))
    here = placed(surface, unit_m=0.001, structural=True, position=np.array([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(here.vertices, [[-0.5, 0.2, -0.03]])
    there = placed(surface, unit_m=0.001, structural=False, position=np.zeros(3))
    np.testing.assert_allclose(there.vertices, [[1.0, 0.2, 0.03]])
