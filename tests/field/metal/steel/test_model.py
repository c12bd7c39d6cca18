"""The steel of an aircraft as one model: at any place, kept by content, and refused by name where it cannot be."""

import re
from pathlib import Path

import numpy as np
import pytest

from magsim.aircraft import Aircraft, load_aircraft, mesh_files
from magsim.errors import RequestError
from magsim.field import compute_response, load_response, obstacles, response_at
from magsim.field.geometry.meshes import box_surface, icosphere
from magsim.field.geometry.meshfile import MAX_TRIANGLES
from magsim.field.metal.steel.meshing import MAX_PANELS
from magsim.field.metal.steel.model import SteelModel, load_steel
from magsim.field.sources.dipoles import dipole_field
from magsim.units import MU0
from tests.support import bodies
from tests.support.exported import exported
from tests.support.steel_kinds import ALL_KINDS, BALLAST, FIREWALL, LEG, MOUNT, RAIL, TANK, magnetics

FACTS = load_aircraft("c208b").facts
BALL = {"kind": "mesh", "name": "ball", "file": "ball.stl", "body": "solid", "unit_m": 1.0, "axes": "body"}
DIPOLE = {"name": "magnet", "position_m": [0.0, 0.0, 1.0], "moment_am2": [2.0, 0.0, -5.0], "source": "a test"}
POINT = np.array([[0.3, -0.9, 0.4]])


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAGSIM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "steel"


def _aircraft(*parts: dict, files: dict[str, bytes] | None = None, **more: object) -> Aircraft:
    return Aircraft("test", FACTS, magnetics(*parts, **more), files or {})


def _ball(radius: float = 0.5, **more: object) -> Aircraft:
    content = exported("stl", icosphere(2, radius, keep="volume"))
    return _aircraft(BALL | {"mu_r": 100.0}, files={"ball.stl": content}, **more)


def test_every_kind_of_part_together() -> None:
    parts = [part | {"element_m": 2.0 * part["element_m"]} if "element_m" in part else part for part in ALL_KINDS]
    model = load_steel(_aircraft(*parts))
    assert model.names[:4] == ("tank", "engine", "firewall", "seat_rail")
    assert "gear_leg_mirror" in model.names
    alpha = model.polarizability
    assert np.abs(alpha - alpha.T).max() < 1e-12 * np.abs(alpha).max()
    assert np.linalg.eigvalsh(alpha).min() > 0.0
    slope = model.at(np.array([[0.4, 0.0, -0.3]])).induced_gradient[0]
    assert np.abs(np.einsum("iki->k", slope)).max() < 1e-12 * np.abs(slope).max()
    assert np.abs(slope - np.swapaxes(slope, 0, 2)).max() < 1e-12 * np.abs(slope).max()


def test_parts_on_both_sides_keep_the_aircraft_symmetric() -> None:
    """In the plane of symmetry a field along x or z makes none along y, but for a mesh that is not symmetric."""
    parts = [part | {"element_m": 0.3} for part in (FIREWALL, RAIL, MOUNT, LEG)]
    induced = load_steel(_aircraft(*parts)).at(np.array([[0.4, 0.0, -0.3]])).induced[0]
    across = (induced[0, 1], induced[1, 0], induced[1, 2], induced[2, 1])
    assert max(map(abs, across)) < 2e-3 * np.abs(induced).max()


def test_kept_by_content(cache: Path) -> None:
    aircraft = _ball()
    first = load_steel(aircraft)
    assert len(list(cache.iterdir())) == 1
    again = load_steel(aircraft)
    assert len(list(cache.iterdir())) == 1
    for name in ("corners", "charge", "reaction", "polarizability", "walls"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
        assert not getattr(again, name).flags.writeable
    # Another file of the same name is another body; so is its response.
    other = _ball(0.4)
    assert load_steel(other).polarizability[0, 0] < 0.6 * first.polarizability[0, 0]
    assert len(list(cache.iterdir())) == 2
    assert np.abs(load_response(other).induced).max() < 0.6 * np.abs(load_response(aircraft).induced).max()


def test_ball_from_a_file_is_a_sphere() -> None:
    model = load_steel(_ball())
    np.testing.assert_allclose(model.polarizability, bodies.sphere_moment(100.0, 0.5) * np.eye(3), atol=2e-4)
    points = np.array([[0.0, 0.0, 1.5], [1.0, -0.5, 0.2]])
    assert bodies.field_error(model.at(points).induced, bodies.sphere_moment(100.0, 0.5), points) < 0.003


def test_sheet_from_a_file_is_the_box_by_code() -> None:
    part = {
        "kind": "mesh",
        "name": "box",
        "file": "box.obj",
        "body": "sheet",
        "thickness_m": 0.0015,
        "axes": "structural",
    }
    tank = box_surface((1800.0, 0.0, -400.0), (1000.0, 800.0, 600.0), 100.0)
    file = _aircraft(part | {"unit_m": 0.001}, files={"box.obj": exported("obj", tank, digits=12)})
    here, there = load_steel(file).at(POINT).induced, load_steel(_aircraft(TANK)).at(POINT).induced
    np.testing.assert_allclose(here, there, atol=2e-3 * np.abs(there).max())


def test_no_steel_adds_nothing() -> None:
    model = load_steel(_aircraft())
    field = model.at(POINT)
    assert not np.any(field.induced)
    assert not np.any(field.induced_gradient)
    assert not np.any(field.reaction_nt)
    assert model.obstacles(POINT) == [None]


class TestPermanentMoments:
    def test_an_installed_one_leaves_the_steel_alone(self) -> None:
        for dipole in (DIPOLE, DIPOLE | {"installed": True}):
            response = compute_response(_ball(permanent=[dipole]))
            bare = dipole_field(np.array(DIPOLE["position_m"]), np.array(DIPOLE["moment_am2"]), response.positions_m)
            np.testing.assert_array_equal(response.permanent_nt, bare)

    def test_another_magnetizes_it(self) -> None:
        aircraft = _ball(permanent=[DIPOLE | {"installed": False}])
        place, moment = np.array(DIPOLE["position_m"]), np.array(DIPOLE["moment_am2"])
        response = response_at(aircraft, {"here": POINT[0]})
        series = bodies.dipole_beside_sphere(bodies.solid_factors(100.0), 0.5, place, moment, POINT)
        exact = dipole_field(place, moment, POINT) + MU0 * 1e9 * series
        assert np.abs(MU0 * 1e9 * series).max() > 0.1 * np.abs(exact).max()
        np.testing.assert_allclose(response.permanent_nt, exact, atol=0.01 * np.abs(MU0 * 1e9 * series).max())

    def test_gradient_of_the_reaction_by_finite_differences(self) -> None:
        model, step = load_steel(_ball(permanent=[DIPOLE | {"installed": False}])), 1e-3
        slope = model.at(POINT).reaction_gradient_nt_pm[0]
        for axis, e in enumerate(step * np.eye(3)):
            at = [model.at(POINT + k * e).reaction_nt[0] for k in (-2, -1, 1, 2)]
            numeric = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * step)
            np.testing.assert_allclose(slope[:, axis], numeric, atol=1e-7 * np.abs(slope).max())
        assert abs(np.trace(slope)) < 1e-12 * np.abs(slope).max()
        assert np.abs(slope - slope.T).max() < 1e-12 * np.abs(slope).max()

    @pytest.mark.parametrize(
        ("z", "text"), [(0.1, "inside steel part 'ball'"), (0.55, "0.0442 m from steel part 'ball'")]
    )
    def test_one_in_or_at_the_steel_is_refused(self, z: float, text: str) -> None:
        dipole = DIPOLE | {"installed": False, "position_m": [0.0, 0.0, z]}
        with pytest.raises(RequestError, match=rf"dipole 'magnet', which .* at \(.*{text}.*installed = true"):
            load_steel(_ball(permanent=[dipole]))
        load_steel(_ball(permanent=[dipole | {"installed": True}]))


class TestObstacles:
    @pytest.fixture
    def model(self) -> SteelModel:
        return load_steel(_ball())

    def test_inside_near_and_far(self, model: SteelModel) -> None:
        inside, near, far = model.obstacles(np.array([[0.1, 0.0, 0.0], [0.0, 0.55, 0.0], [0.0, 0.0, 0.9]]))
        assert inside == "inside steel part 'ball'; allowed: a place in the air"
        assert near == "0.0442 m from steel part 'ball'; allowed: at least 0.0791 m, 0.5 elements of its mesh there"
        assert far is None

    def test_mounts_and_places_are_refused_by_name(self) -> None:
        with pytest.raises(RequestError, match=r"^aircraft test: place 'seat' at \(0.1, 0, 0\) m is inside steel part"):
            response_at(_ball(), {"seat": (0.1, 0.0, 0.0)})
        mounts = {"mast": {"position_m": [0.0, 0.52, 0.0], "source": "a test"}}
        with pytest.raises(RequestError, match=r"^aircraft test: mount 'mast' at \(0, 0.52, 0\) m is 0.0142 m from"):
            load_response(_ball(mounts=mounts))

    def test_of_all_kinds_at_many_places(self) -> None:
        aircraft = _ball(permanent=[DIPOLE])
        places = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.1], [0.0, 0.52, 0.0], [2.0, 0.0, 0.0]])
        metal, magnet, near, free = obstacles(aircraft, places)
        assert metal.startswith("inside steel part 'ball'")
        assert magnet == "0.1 m from dipole 'magnet'; allowed: at least 0.2 m"
        assert near.startswith("0.0142 m from steel part 'ball'")
        assert free is None

    def test_a_place_on_a_panel(self, model: SteelModel) -> None:
        on = model.corners[5].mean(axis=0)
        assert re.match(r"(inside|[\de.-]+ m from) steel part 'ball'", model.obstacles(on[None])[0])

    def test_inside_a_thin_tank_there_is_air(self) -> None:
        model = load_steel(_aircraft(TANK))
        middle, wall = model.obstacles(np.array([[-1.8, 0.0, 0.4], [-1.8, 0.0, 0.68]]))
        assert middle is None
        assert wall == "0.02 m from steel part 'tank'; allowed: at least 0.05 m, 0.5 elements of its mesh there"


KNOT = [[0.0, 3.0, 0.0], [1.0, 3.0, 0.0], [1.0, 4.0, 0.0], [0.5, 4.0, 0.0], [0.5, 2.5, 0.02]]
BAD_PARTS = {
    "touching": ([TANK, TANK | {"name": "twin"}], r"steel parts 'tank' and 'twin' touch or cross at \("),
    "crossing": (
        [TANK, FIREWALL | {"center_m": [-1.8, 0.0, 0.4]}],
        r"steel parts 'tank' and 'firewall' touch or cross at \(.*leave one, or make them one part",
    ),
    "too close": (
        [TANK, FIREWALL | {"center_m": [-1.2995, 0.0, 0.4]}],
        r"steel parts 'tank' and 'firewall' are only 0.0005 m apart at \(",
    ),
    "its own mirror image": (
        [BALLAST | {"mirror": True}],
        r"steel parts 'ballast' and 'ballast_mirror' touch or cross",
    ),
    "one in another": (
        [
            BALLAST | {"size_m": [0.4, 0.4, 0.4], "element_m": 0.2},
            BALLAST | {"name": "core", "size_m": [0.1, 0.1, 0.1]},
        ],
        "steel part 'core' lies inside steel part 'ballast'",
    ),
    "loft through itself": (
        [
            LEG
            | {"across": [0.0, 0.0, 1.0], "sections": [{"center_m": center, "size_m": [0.1, 0.1]} for center in KNOT]}
        ],
        r"steel part 'gear_leg' crosses or touches itself near \(",
    ),
    "tube through itself": (
        [MOUNT | {"points_m": KNOT}],
        r"steel part 'engine_mount' crosses or touches itself near \(",
    ),
    "bend sharper than the tube": (
        [MOUNT | {"points_m": [[0.0, 3.0, 0.0], [1.0, 3.0, 0.0], [1.0, 3.01, 0.0], [0.0, 3.02, 0.0]]}],
        r"steel part 'engine_mount' (crosses|has)",
    ),
    "too fine": (
        [FIREWALL | {"element_m": 0.02}],
        rf"the steel has \d+ charged triangles, most of them 'firewall' with \d+; allowed: up to {MAX_PANELS}",
    ),
    "far too fine": ([FIREWALL | {"element_m": 1e-5}], "steel part 'firewall' would have a mesh of more than"),
}


@pytest.mark.parametrize("name", BAD_PARTS)
def test_bad_parts_are_told_by_name(name: str) -> None:
    parts, text = BAD_PARTS[name]
    with pytest.raises(RequestError, match=f"^aircraft test: {text}"):
        load_steel(_aircraft(*parts))


def _stl(surface: object) -> dict[str, bytes]:
    return {"ball.stl": exported("stl", surface)}


OPEN = icosphere(2, 0.5)
BAD_FILES = {
    "open": (_stl(type(OPEN)(OPEN.vertices, OPEN.triangles[1:])), r"is open: 3 edges, the first at \("),
    "no mesh": ({"ball.stl": b"solid nothing\nendsolid\n"}, r"cannot be read as STL|holds no triangles"),
    "too many": (_stl(icosphere(5, 0.5)), f"has 20480 triangles; allowed: up to {MAX_TRIANGLES}"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_told_by_name(name: str) -> None:
    files, text = BAD_FILES[name]
    with pytest.raises(RequestError, match=rf"^aircraft test: steel part 'ball' \(ball.stl\) (?:{text})"):
        load_steel(_aircraft(BALL, files=files))


class TestFilesOfAnAircraft:
    def test_are_read_from_its_folder(self, tmp_path: Path) -> None:
        (tmp_path / "ball.stl").write_bytes(b"content")
        assert mesh_files(tmp_path, magnetics(BALL, BALL | {"name": "again"})) == {"ball.stl": b"content"}
        assert mesh_files(tmp_path, magnetics(TANK)) == {}

    def test_that_are_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(RequestError, match=r"magnetics.toml: steel part 'ball': ball.stl: there is no such file"):
            mesh_files(tmp_path, magnetics(BALL))

    def test_that_lie_elsewhere(self, tmp_path: Path) -> None:
        folder = tmp_path / "plane"
        folder.mkdir()
        (tmp_path / "secret.stl").write_bytes(b"secret")
        (folder / "ball.stl").symlink_to(tmp_path / "secret.stl")
        with pytest.raises(RequestError, match="lies elsewhere; allowed: a file in the folder of the aircraft"):
            mesh_files(folder, magnetics(BALL))

    def test_that_are_too_large(self, tmp_path: Path) -> None:
        with (tmp_path / "ball.stl").open("wb") as file:
            file.truncate(20_000_001)
        with pytest.raises(RequestError, match="has 20000001 bytes; allowed: up to 20000000"):
            mesh_files(tmp_path, magnetics(BALL))
