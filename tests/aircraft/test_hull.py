"""Lengths in millimeters are refused where an aircraft's files are read."""

import shutil
from pathlib import Path

import pytest

from magsim import assets
from magsim.aircraft import load_aircraft, load_bird
from magsim.aircraft.hull import beyond_hull, reach_m
from magsim.errors import RequestError


def changed(tmp_path: Path, name: str, old: str, new: str) -> Path:
    folder = tmp_path / "mine"
    shutil.copytree(assets.aircraft_dir(name), folder)
    path = folder / "magnetics.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return folder


def test_shipped_vehicles_are_within_their_hulls():
    vehicles = [*(load_aircraft(name) for name in ("c208b", "uav", "helicopter")), load_bird("bird")]
    for vehicle in vehicles:
        assert list(beyond_hull(vehicle.magnetics, vehicle.facts)) == []
    # Span 15.87 m, length of the bird 2.6 m; a kinematic helicopter has no size.
    assert [round(reach_m(vehicle.facts), 2) for vehicle in vehicles] == [31.74, 5.79, 100.0, 5.2]


MOVED = {
    "mounts.cabin_rear": ("c208b", "position_m = [-3.0, 0.0", "position_m = [-3000.0, 0.0"),
    "permanent[0]": ("c208b", "position_m = [3.40, 0.0", "position_m = [3400.0, 0.0"),
    "mounts.tail": ("helicopter", "position_m = [-9.70", "position_m = [-9700.0"),
}


@pytest.mark.parametrize("key", MOVED)
def test_a_place_in_millimeters_is_refused_by_key_and_value(tmp_path, key):
    name, old, new = MOVED[key]
    folder, most = changed(tmp_path, name, old, new), "100" if name == "helicopter" else "31.74"
    with pytest.raises(RequestError) as caught:
        load_aircraft(folder)
    (line,) = str(caught.value).splitlines()
    length = new.split("[")[1].split(".")[0]
    assert line == (
        f"{folder / 'magnetics.toml'}: {key}.position_m[0]: {length} m is off the hull; allowed: -{most} to {most}, "
        "lengths are in meters"
    )
