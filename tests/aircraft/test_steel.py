"""What a part of steel may say, and how far it is from a place."""

import copy

import pytest
from pydantic import ValidationError

from magsim.aircraft import load_aircraft
from tests.support.steel_kinds import ALL_KINDS, BALLAST, ENGINE, FIREWALL, LEG, MOUNT, RAIL, TANK, magnetics, steel

MESH = {"kind": "mesh", "name": "cast", "file": "cast.stl", "body": "solid", "unit_m": 0.001, "axes": "structural"}

WRONG = {
    "permeability below 1": (TANK | {"mu_r": 0.999}, "greater than or equal to 1"),
    "no thickness": (TANK | {"thickness_m": 0.0}, "greater than 0"),
    "thick box": (TANK | {"thickness_m": 0.1}, "no thin sheet; allowed: up to 1/20 of the smallest side, 0.03"),
    "thick plate": (FIREWALL | {"thickness_m": 0.2}, "no thin sheet; allowed: up to 1/10 of the smaller side, 0.1"),
    "thick strip": (RAIL | {"thickness_m": 0.01}, "no thin sheet; allowed: up to 1/10 of width_m, 0.004"),
    "thick tube": (MOUNT | {"thickness_m": 0.003}, "no thin sheet; allowed: up to 1/5 of radius_m, 0.0024"),
    "no unit vector": (FIREWALL | {"normal": [1.0, 1.0, 0.0]}, "allowed: a unit vector"),
    "oblique plate": (FIREWALL | {"along": [0.6, 0.8, 0.0]}, "normal and along are not perpendicular"),
    "oblique bar": (BALLAST | {"across": [0.0, 1.0, 0.0]}, "along and across are not perpendicular"),
    "flat bar": (BALLAST | {"size_m": [0.3, 0.0, 0.1]}, "three positive lengths"),
    "flat plate": (FIREWALL | {"size_m": [1.2, 0.0]}, "greater than 0"),
    "line of one point": (RAIL | {"points_m": [[0.0, 0.0, 0.0]]}, "at least 2 items"),
    "line that stands": (
        RAIL | {"points_m": [[1.0, 0.0, 0.0]] * 2},
        r"points_m\[0\] and points_m\[1\] are the same place",
    ),
    "line that turns back": (
        MOUNT | {"points_m": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.1, 0.0]]},
        r"the line turns back at points_m\[1\]; allowed: bends up to 120 deg",
    ),
    "strip on edge": (RAIL | {"facing": [1.0, 0.0, 0.0]}, "facing = .* runs along the part"),
    "loft on edge": (
        LEG
        | {
            "across": [0.0, 0.0, 1.0],
            "sections": [
                {"center_m": [0.0, 0.0, 0.0], "size_m": [0.1, 0.1]},
                {"center_m": [0.0, 0.0, 1.0], "size_m": [0.1, 0.1]},
            ],
        },
        "across = .* runs along the part",
    ),
    "no element": (LEG | {"element_m": 0.0}, "greater than 0"),
    "file elsewhere": (MESH | {"file": "../cast.stl"}, "should match pattern"),
    "file of another kind": (MESH | {"file": "cast.gltf"}, "should match pattern"),
    "sheet without thickness": (MESH | {"body": "sheet"}, "allowed: thickness_m with a sheet"),
    "solid with thickness": (MESH | {"thickness_m": 0.001}, "allowed: thickness_m with a sheet"),
    "no axes": ({key: value for key, value in MESH.items() if key != "axes"}, "axes"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_parts(name: str) -> None:
    part, text = WRONG[name]
    with pytest.raises(ValidationError, match=text):
        steel(part)


def test_aluminum_and_air_are_allowed() -> None:
    assert steel(TANK | {"mu_r": 1.000022})[0].mu_r == 1.000022
    assert steel(TANK | {"mu_r": 1.0})[0].mu_r == 1.0


def test_names_of_mirror_images_must_differ_too() -> None:
    with pytest.raises(ValidationError, match="used twice: seat_rail_mirror"):
        steel(RAIL, TANK | {"name": "seat_rail_mirror"})


@pytest.mark.parametrize(
    ("part", "place", "distance"),
    [
        (FIREWALL, (2.0, 0.0, 0.1), 0.25),
        (FIREWALL, (2.25, 1.0, 0.1), 0.4),
        (FIREWALL, (2.25, 0.1, 0.2), 0.0),
        (RAIL, (0.0, 0.5, 0.35), 0.28),
        (RAIL, (0.0, -0.5, 0.35), 0.28),
        (MOUNT, (2.35, 0.5, 0.9), 0.488),
        (BALLAST, (-6.0, 0.0, 0.1), 0.075),
        (BALLAST, (-6.0, 0.0, 0.0), -0.025),
        (ENGINE, (4.4, 0.0, 0.0), 0.3),
        (TANK, (-1.8, 0.0, 0.0), 0.1),
        (TANK, (-1.8, 0.0, 0.4), 0.3),
    ],
)
def test_distances_of_places(part: dict, place: tuple[float, float, float], distance: float) -> None:
    assert steel(part)[0].clearance_m(place) == pytest.approx(distance, abs=1e-12)


def test_what_only_the_mesh_knows_stands_in_no_ones_way_here() -> None:
    file = magnetics(LEG, MESH)
    assert file.obstacle((-0.3, 1.3, 1.2)) is None
    assert magnetics(*ALL_KINDS).obstacle((2.25, 0.0, 0.1)).startswith("0 m from steel part 'firewall'")


def test_a_hinged_moment_is_an_installed_one() -> None:
    shipped = load_aircraft("c208b").magnetics
    settings = copy.deepcopy(shipped.model_dump())
    settings["hinged"][0]["installed"] = False
    with pytest.raises(ValidationError, match="installed"):
        type(shipped).model_validate(settings)
    assert all(dipole.installed for dipole in shipped.permanent)
