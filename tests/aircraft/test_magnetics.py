"""What a magnetic file may contain, and the errors of what it may not."""

import copy
import tomllib

import numpy as np
import pytest
from pydantic import ValidationError

from magsim import assets
from magsim.aircraft import Magnetics, load_aircraft

SGL_RAIL_M = {
    "sgl_mag_1": (-12.01, 0.0, 1.37),
    "sgl_mag_2": (-0.60, -0.36, 0.0),
    "sgl_mag_3": (-1.28, -0.36, 0.0),
    "sgl_mag_4": (-3.53, 0.0, 0.0),
    "sgl_mag_5": (-3.79, 0.0, 1.20),
    "sgl_flux_a": (-3.27, -0.60, 0.0),
    "sgl_flux_b": (-8.92, 0.0, 0.96),
    "sgl_flux_c": (-4.06, 0.42, 0.0),
    "sgl_flux_d": (-4.06, -0.42, 0.0),
}
"""Forward, port, up from the front seat rail: SGL 2020 data sheet in MagNav.jl."""


@pytest.fixture
def settings() -> dict:
    path = assets.aircraft_dir("c208b") / "magnetics.toml"
    return copy.deepcopy(tomllib.loads(path.read_text(encoding="utf-8")))


def test_sgl_mounts_come_from_the_data_sheet_by_one_shift() -> None:
    mounts = load_aircraft("c208b").mounts
    shifts = np.array(
        [np.array(mounts[name]) - np.array(rail) * [1.0, -1.0, -1.0] for name, rail in SGL_RAIL_M.items()]
    )
    np.testing.assert_allclose(shifts, np.broadcast_to([0.90, 0.0, 0.55], shifts.shape), atol=1e-12)
    assert mounts["cabin_center"] == (0.0, 0.0, 0.0)


def test_every_group_says_where_it_comes_from() -> None:
    magnetics = load_aircraft("c208b").magnetics
    groups = (*magnetics.mounts.values(), *magnetics.permanent, *magnetics.hinged, *magnetics.steel, *magnetics.coils)
    assert all(len(group.source) >= 10 for group in groups)


def _refused(settings: dict, text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        Magnetics.model_validate(settings)


def test_unknown_key(settings: dict) -> None:
    settings["permanent"][0]["moment_nt"] = 1.0
    _refused(settings, "moment_nt")


def test_unknown_kind_of_steel(settings: dict) -> None:
    settings["steel"][0]["kind"] = "sphere"
    _refused(settings, "box_sheet")


def test_hinge_axis_must_be_a_unit_vector(settings: dict) -> None:
    settings["hinged"][0]["hinge_axis"] = [0.0, 2.0, 0.0]
    _refused(settings, "length 2; allowed: a unit vector")


def test_unknown_surface(settings: dict) -> None:
    settings["hinged"][0]["surface"] = "spoiler"
    _refused(settings, "aileron_left")


def test_resistance_of_a_coil_must_be_clear(settings: dict) -> None:
    settings["coils"][0]["conductivity_spm"] = 1.7e7
    _refused(settings, "its resistance is not clear")
    del settings["coils"][0]["time_constant_s"]
    _refused(settings, "its resistance is not clear")
    settings["coils"][0]["section_m2"] = 1e-3
    assert Magnetics.model_validate(settings).coils[0].section_m2 == 1e-3


def test_names_must_differ(settings: dict) -> None:
    settings["hinged"][0]["name"] = settings["permanent"][0]["name"]
    _refused(settings, "used twice: engine")


def test_sheet_must_be_thin(settings: dict) -> None:
    settings["steel"][0]["thickness_m"] = 0.1
    _refused(settings, "no thin sheet")


def test_box_needs_three_lengths(settings: dict) -> None:
    settings["steel"][0]["size_m"] = [1.0, 0.0, 0.6]
    _refused(settings, "three positive lengths")


def test_mesh_must_not_explode(settings: dict) -> None:
    settings["steel"][0]["element_m"] = 0.001
    _refused(settings, "too many triangles")


@pytest.mark.parametrize(
    ("place", "culprit"),
    [
        ([-1.8, 0.0, 0.69], "0.01 m from steel part 'fuel_tank'"),
        ([-2.31, 0.0, 0.4], "0.01 m from steel part 'fuel_tank'"),
        ([3.4, 0.0, 0.1], "inside steel part 'engine'"),
        ([3.4, 0.0, 0.3], "0.06 m from steel part 'engine'"),
        ([-0.95, 0.15, -0.7], "0.1 m from dipole 'flap_motor'"),
    ],
)
def test_mounts_keep_off_steel_and_dipoles(settings: dict, place: list[float], culprit: str) -> None:
    settings["mounts"]["bad"] = {"position_m": place, "source": "a test"}
    _refused(settings, culprit)


def test_a_sensor_may_sit_inside_the_tank(settings: dict) -> None:
    settings["mounts"]["tank"] = {"position_m": [-1.8, 0.0, 0.4], "source": "a test"}
    assert "tank" in Magnetics.model_validate(settings).mounts


def test_what_turns_needs_its_rotor(settings: dict) -> None:
    settings["rotating"][0]["rotor"] = "fan"
    _refused(settings, "turns with rotor 'fan', which is not there; allowed: propeller")
    settings["rotors"] = {}
    _refused(settings, r"allowed: none, give a table \[rotors.NAME\]")


def test_blade_lies_across_its_axis(settings: dict) -> None:
    settings["rotating"][0]["polarizability_m3"] = [1e-3, 0.0, 0.0]
    _refused(settings, "has a polarizability but no blade")
    settings["rotating"][0]["blade"] = [0.6, 0.8, 0.0]
    _refused(settings, "is not across the axis .* of its rotor")
    settings["rotating"][0]["blade"] = [0.0, 0.0, 1.0]
    assert Magnetics.model_validate(settings).rotating[0].blade == (0.0, 0.0, 1.0)
    settings["rotating"][0]["polarizability_m3"] = [1e-3, -1e-4, 0.0]
    _refused(settings, "none below 0")


def test_a_rotating_part_keeps_off_mounts(settings: dict) -> None:
    settings["mounts"]["hub"] = {"position_m": [4.3, 0.0, 0.0], "source": "a test"}
    _refused(settings, "0.15 m from dipole 'propeller'")


def test_memory_has_as_many_weights_as_radii(settings: dict) -> None:
    good = settings["memory"]
    for change, message in (
        ({"weights": [0.02]}, "1 weights but 3 radii_nt; allowed: as many of both"),
        ({"viscosity_s": [1.0]}, "3 viscosity_weights but 1 viscosity_s"),
        ({"radii_nt": [-1.0, 2.0, 3.0]}, "radii_nt = .*: allowed: none below 0"),
        ({"weights": [0.02, -0.02, 0.02]}, "weights = .*: allowed: none below 0"),
        ({"viscosity_s": [0.0, 1.0, 2.0]}, "greater than 0"),
    ):
        settings["memory"] = good | change
        _refused(settings, message)


def test_modes_of_a_mount(settings: dict) -> None:
    mode = settings["mounts"]["sgl_mag_1"]["flex"][0]
    for change, message in (
        ({"direction": [0.0, 0.0, 2.0]}, "length 2; allowed: a unit vector"),
        ({"damping": 1.0}, "less than 1"),
        ({"frequency_hz": 0.0}, "greater than 0"),
        ({"compliance_mmpg": 0.3}, "frequency_hz with damping for a boom that swings, or compliance_mmpg without"),
    ):
        settings["mounts"]["sgl_mag_1"]["flex"] = [mode | change]
        _refused(settings, message)
    bare = {"direction": [0.0, 0.0, 1.0], "source": "a test"}
    settings["mounts"]["sgl_mag_1"]["flex"] = [bare]
    _refused(settings, "frequency_hz with damping")
    settings["mounts"]["sgl_mag_1"]["flex"] = [bare | {"compliance_mmpg": -1.0}]
    _refused(settings, "greater than 0")


def test_what_was_read_can_be_read_again() -> None:
    for name in ("c208b", "uav", "helicopter"):
        magnetics = load_aircraft(name).magnetics
        assert Magnetics.model_validate(magnetics.model_dump(mode="json")) == magnetics


def test_controls_move(settings: dict) -> None:
    good = settings["controls"][0]
    for change, message in (
        (
            {"travel_mmpdeg": [0.0, 0.0, 0.0]},
            "yoke_column does not move; allowed: travel_mmpdeg, turn_degpdeg",
        ),
        ({"turn_degpdeg": 2.0}, "turn_degpdeg, turn_point_m and turn_axis together, or none"),
        ({"turn_axis": [1.0, 0.0, 0.0]}, "turn_degpdeg, turn_point_m and turn_axis together, or none"),
        ({"turn_degpdeg": 2.0, "turn_point_m": [0.0, 0.0, 0.0], "turn_axis": [2.0, 0.0, 0.0]}, "a unit vector"),
        ({"surface": "spoiler"}, "'elevator'"),
    ):
        settings["controls"] = [good | change]
        _refused(settings, message)


def test_suspensions_and_what_hangs_on_them(settings: dict) -> None:
    good = settings["suspensions"]["engine"]
    settings["suspensions"] = {"engine": good | {"compliance_mmpg": [0.0, 0.0, 0.0]}}
    _refused(settings, "none below 0 and one above")
    settings["suspensions"] = {"mast": good}
    _refused(settings, "dipole 'engine' hangs on 'engine'; allowed: mast")
    free = [{key: value for key, value in part.items() if key != "suspension"} for part in settings["permanent"]]
    settings["permanent"] = free
    _refused(settings, "rotating part 'propeller' hangs on 'engine'; allowed: mast")
    settings["rotating"] = []
    _refused(settings, "steel part 'engine' hangs on 'engine'; allowed: mast")
