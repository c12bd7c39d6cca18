"""The mesh of the skin: sizes, soundness, and the refusal of a mesh that is not sound."""

import copy
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pydantic import ValidationError

from magsim.aircraft import Aircraft, Magnetics, load_aircraft
from magsim.aircraft.magnetics import DrawnOutline, Skin
from magsim.errors import RequestError
from magsim.field import load_response, obstacles
from magsim.field.geometry.meshes import TriangleMesh, box_surface, icosphere
from magsim.field.geometry.refine import distance_to_triangles, refine
from magsim.field.metal.skin.lofts import ellipse, superellipse, volume
from magsim.field.metal.skin.mesh import Outline, checked, graded, join, outline
from magsim.field.metal.skin.model import SkinModel, compute_skin, shells_of, truncation_error
from magsim.field.metal.skin.shells import ThinShells, driven_modes, stream_field

NOWHERE = np.zeros((0, 3))


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft("c208b")


@pytest.fixture(scope="module")
def whole(aircraft: Aircraft) -> Outline:
    return outline(aircraft.magnetics.skin)


def _panels(**changes: object) -> dict:
    wing = {
        "kind": "panel",
        "name": "wing",
        "span": "right",
        "conductivity_spm": 1.74e7,
        "thickness_m": 0.001,
        "sections": [
            {"at_m": 0.0, "leading_edge_m": 0.5, "chord_m": 1.0, "depth_m": 0.3},
            {"at_m": 2.0, "leading_edge_m": 0.4, "chord_m": 0.8, "depth_m": 0.2},
        ],
        "source": "a test",
    }
    body = {
        "kind": "body",
        "name": "hull",
        "conductivity_spm": 1.0e7,
        "thickness_m": 0.002,
        "sections": [
            {"x_m": 1.0, "width_m": 0.4, "height_m": 0.4, "z_m": 0.6},
            {"x_m": -1.0, "width_m": 0.6, "height_m": 0.5, "z_m": 0.6, "exponent": 3.0},
        ],
        "source": "a test",
    }
    settings = {"element_m": 0.4, "parts": [wing, body]}
    settings.update(changes)
    return settings


SENSORS = np.array([[0.0, 0.3, 0.25]])


@pytest.fixture(scope="module")
def small() -> SkinModel:
    return compute_skin(Skin.model_validate(_panels()), SENSORS)


def test_the_skin_has_the_published_size(aircraft: Aircraft, whole: Outline) -> None:
    """Span 15.87 m and length 12.68 m; the fin ends 4.52 m (14 ft 10 in) over the ground on which the wheels stand."""
    low, high = whole.extent_m
    ground = max(wheel.value[2] for wheel in aircraft.facts.geometry.wheels)
    assert high[1] - low[1] == pytest.approx(15.87, rel=0.005)
    assert high[0] - low[0] == pytest.approx(12.68, rel=0.005)
    assert ground - low[2] == pytest.approx(4.52, rel=0.005)


def test_the_skin_is_closed_and_every_part_is_symmetric(whole: Outline) -> None:
    assert whole.names == ("fuselage", "wing", "tailplane", "fin")
    for name in whole.names:
        part = whole.of(name)
        mesh = trimesh.Trimesh(part.vertices, part.triangles, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(volume(part.vertices, part.triangles))
        assert mesh.volume > 0.0
        mirrored = np.round(part.vertices * (1.0, -1.0, 1.0), 9) + 0.0
        assert set(map(tuple, mirrored)) == set(map(tuple, np.round(part.vertices, 9) + 0.0))


def test_currents_of_a_symmetric_skin_are_symmetric(aircraft: Aircraft) -> None:
    """In the plane of symmetry a change along x or z makes no field along y."""
    skin = aircraft.magnetics.skin.model_copy(update={"element_m": 1.6})
    mesh = outline(skin)
    modes = driven_modes(ThinShells(mesh.surface, 1.74e4), 1)
    slow = stream_field(mesh.surface, modes.streams, np.array([[0.2, 0.0, 0.1]]))[0] @ modes.drive
    assert max(abs(slow[0, 1]), abs(slow[1, 0]), abs(slow[1, 2]), abs(slow[2, 1])) < 1e-9 * np.abs(slow).max()


def test_sections_have_their_exact_area() -> None:
    def area(corners: np.ndarray) -> float:
        u, v = corners.T
        return 0.5 * abs(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1)))

    assert area(ellipse(16, (0.9, 0.1))) == pytest.approx(np.pi * 0.09, rel=1e-12)
    assert area(superellipse(20, (0.8, 0.7), 2.0)) == pytest.approx(np.pi * 0.56, rel=1e-12)
    # A large exponent is a rectangle.
    assert area(superellipse(20, (0.8, 0.7), 200.0)) == pytest.approx(4.0 * 0.56, rel=2e-3)


def test_refined_mesh_is_the_same_surface(whole: Outline) -> None:
    place = np.array([[-2.9, 0.0, -0.65]])
    fine = graded(whole, 0.5, place)
    mesh = trimesh.Trimesh(fine.surface.vertices, fine.surface.triangles, process=False)
    coarse = trimesh.Trimesh(whole.surface.vertices, whole.surface.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(coarse.volume, rel=1e-12)
    assert mesh.area == pytest.approx(coarse.area, rel=1e-12)
    corners = fine.surface.vertices[fine.surface.triangles]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    assert np.all(longest <= distance_to_triangles(place, corners)[0] + 1e-12)
    for number, name in enumerate(whole.names):
        grown = fine.surface.triangles[fine.part == number]
        assert len(np.unique(grown)) >= len(whole.of(name).vertices)


def test_bisection_keeps_angles() -> None:
    def large(corners: np.ndarray, _: np.ndarray) -> np.ndarray:
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        return longest > 0.1 + 0.5 * np.abs(1.0 - corners.mean(axis=1)[:, 2])

    fine, parent = refine(icosphere(1, 1.0), large)
    assert len(parent) > 80
    mesh = trimesh.Trimesh(fine.vertices, fine.triangles, process=False)
    assert mesh.is_watertight
    assert np.degrees(mesh.face_angles.min()) > 25.0


def test_distance_to_a_triangle() -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    points = np.array([[0.2, 0.2, 0.5], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-0.3, 0.5, 0.4], [0.1, 0.1, 0.0]])
    expected = [0.5, 1.0, np.sqrt(0.5), 0.5, 0.0]
    np.testing.assert_allclose(distance_to_triangles(points, corners)[:, 0], expected, atol=1e-15)


def test_model_tells_its_error_and_where_it_is_coarse(small: SkinModel) -> None:
    places = np.array([[0.0, 0.3, 0.25], [0.0, 0.0, 2.0], [0.0, 1.0, 0.12]])
    assert truncation_error(Skin.model_validate(_panels()), SENSORS, places).max() < 1e-8
    assert small.resolved(places).tolist() == [True, True, False]
    modes = small.at(places)
    assert modes.field.shape == (3, 3, len(modes.tau_s))


def test_slow_currents_converge_near_the_metal_and_far_from_it(small: SkinModel) -> None:
    """Half the element changes little: 0.1 m from the wing, where the mesh was refined for the sensor, and far away."""
    places = np.array([[0.0, 0.3, 0.25], [3.0, 1.0, 2.0]])
    shells = shells_of(Skin.model_validate(_panels(element_m=0.2)), places[:1])
    fine = driven_modes(shells, 1)
    exact = stream_field(shells.surface, fine.streams, places) @ fine.drive
    modes = small.at(places)
    error = np.linalg.norm(modes.field @ modes.drive - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    assert error.max() < 0.03


# ---- what is refused ----


def test_open_part() -> None:
    mesh = icosphere(1, 1.0)
    with pytest.raises(ValueError, match=r"'dome' is open: 3 edges, the first at \(.*\) m; .* fill the holes"):
        checked(join({"dome": TriangleMesh(mesh.vertices, mesh.triangles[1:])}))


def test_part_with_a_triangle_turned_over() -> None:
    mesh = icosphere(1, 1.0)
    triangles = mesh.triangles.copy()
    triangles[0] = triangles[0, ::-1]
    with pytest.raises(ValueError, match=r"'ball' is turned partly inward: 3 edges, .* make all triangles outward"):
        checked(join({"ball": TriangleMesh(mesh.vertices, triangles)}))


def test_part_with_a_sliver() -> None:
    mesh = icosphere(1, 1.0)
    flat = mesh.vertices.copy()
    a, b, c = mesh.triangles[0]
    flat[a] = 0.5 * (flat[b] + flat[c])
    with pytest.raises(ValueError, match=r"'flat' has degenerate triangles, .* the first at \(.*\) m"):
        checked(join({"flat": TriangleMesh(flat, mesh.triangles)}))


def test_parts_that_cross() -> None:
    settings = _panels()
    settings["parts"][1]["sections"][0]["z_m"] = settings["parts"][1]["sections"][1]["z_m"] = 0.2
    with pytest.raises(ValueError, match=r"'wing' and 'hull' touch or cross at \(.*\) m; .* move or narrow"):
        outline(Skin.model_validate(settings))


def test_part_that_crosses_itself() -> None:
    first, second = box_surface((0, 0, 0), (1, 1, 1), 0.5), box_surface((0.7, 0.1, 0.2), (1, 1, 1), 0.5)
    knot = join({"a": first, "b": second})
    with pytest.raises(ValueError, match=r"'knot' (crosses or touches itself near|has a piece near)"):
        checked(replace(knot, names=("knot",), part=np.zeros(len(knot.part), dtype=int)))


def test_mount_on_the_skin(aircraft: Aircraft) -> None:
    settings = aircraft.magnetics.model_dump(by_alias=True)
    settings["mounts"]["bad"] = {"position_m": [-2.9, 0.0, -0.78], "source": "a test"}
    broken = Aircraft("c208b", aircraft.facts, Magnetics.model_validate(settings))
    with pytest.raises(RequestError, match=r"c208b: the place .* is 0.0\d* m from skin part 'fuselage'; allowed"):
        load_response(broken)
    found = obstacles(aircraft, np.array([[-2.9, 0.0, -0.78], [-2.9, 0.0, -0.6]]))
    assert "skin part 'fuselage'" in found[0]
    assert found[1] is None


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda s: s["parts"][0]["sections"].reverse(), "runs from 0 to its right tip"),
        (lambda s: s["parts"][1]["sections"][0].update(x_m=-1.0), "no two at one place"),
        (lambda s: s["parts"][1].update(name="wing"), "used twice: wing"),
        (lambda s: s["parts"][1].update(thickness_m=0.0), "thickness_m"),
        (lambda s: s["parts"][1].update(kind="sphere"), "body"),
        (lambda s: s.update(element_m=0.01), "element_m"),
    ],
)
def test_file_that_describes_no_skin(change: object, text: str) -> None:
    settings = copy.deepcopy(_panels())
    change(settings)
    with pytest.raises(ValidationError, match=text):
        Skin.model_validate(settings)


def test_skin_of_an_aircraft_without_one(aircraft: Aircraft) -> None:
    settings = aircraft.magnetics.model_dump(by_alias=True)
    settings["skin"] = None
    bare = Aircraft("glider", aircraft.facts, Magnetics.model_validate(settings))
    assert bare.magnetics.eddy_model == "coils"
    with pytest.raises(RequestError, match=r"glider has no \[skin\]"):
        load_response(bare, "skin")


def test_drawn_shells_may_cross_and_lie_aside():
    table = _panels()
    for part in table["parts"]:
        del part["conductivity_spm"], part["thickness_m"]
    for section in table["parts"][1]["sections"]:
        section.update(z_m=0.0, y_m=0.5)
    shells = outline(DrawnOutline.model_validate(table))
    np.testing.assert_allclose(shells.of("hull").vertices[:, 1].mean(), 0.5, atol=1e-12)
    np.testing.assert_allclose(shells.extent_m[:, 1], [-2.0, 2.0], atol=1e-12)
    with pytest.raises(ValidationError, match="conductivity_spm"):
        DrawnOutline.model_validate(_panels())
    twice = table | {"parts": [table["parts"][0], table["parts"][0]]}
    with pytest.raises(ValidationError, match="names of outline parts must differ, used twice: wing"):
        DrawnOutline.model_validate(twice)


def test_an_aircraft_is_drawn_by_its_skin_or_by_its_outline(aircraft: Aircraft):
    drawn = load_aircraft("uav").magnetics.outline.model_dump(mode="json")
    with pytest.raises(ValidationError, match=r"drawn by it; allowed: \[skin\] or \[outline\]"):
        Magnetics.model_validate(aircraft.magnetics.model_dump(mode="json") | {"outline": drawn})
